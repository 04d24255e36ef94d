/// Andrews' squeezing mechanism, from the Test Set for IVP Solvers: seven bodies in a plane, three closed
/// loops.

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string squeezer() {
  // The benchmark's data in its own units, kg and m; here all lengths are ten times as long and everything
  // takes a hundred times as long, so that it can be watched.
  static constexpr double scale = 10;
  constexpr double slow = 100;
  constexpr double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072;
  constexpr double d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421, rr = 0.007, ra = 0.00092, sa = 0.01874,
                   sb = 0.01043, sc = 0.018, sd = 0.02, ta = 0.02308, tb = 0.00916, u = 0.04, ua = 0.01228,
                   ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421;
  constexpr double beta = -0.0617138900142764, theta = 0, gamma = 0.455279819163070, phi = 0.222668390165886,
                   delta = 0.487364979543843, omega = -0.222668390165886, epsilon = 1.23054744454982;
  constexpr double height = 0.45;  // of the crank's axis

  GltfBuilder gltf("squeezer", 3, Vector3::Zero());
  gltf.poster(1.6);
  gltf.camera({-0.1, 0.95, 2.15}, {-0.27, 0.68, 0}, 0.52);
  gltf.sun({-0.35, -0.9, -0.8}, warm_white, daylight);

  const Mesh board = Mesh().add(rounded(box({1.25, 1.2, 0.06}), 0.015), at(-0.27, 0.70, -0.06));
  add_scenery(gltf, "board", board, finish::walnut);
  Mesh stand;
  for (const int side : {-1, 1})
    stand.add(rounded(box({0.08, 0.12, 0.4}), 0.015), at(-0.27 + side * 0.5, 0.06, -0.06));
  add_scenery(gltf, "stand", stand, finish::iron);

  // A frame of the benchmark's plane: everything below is placed in it.
  const int plane = gltf.node("plane", at(0, height, 0));
  struct Place {
    double x;
    double y;
    Vector3 point() const { return Vector3(x, y, 0) * scale; }
  };
  const auto polar = [](double length, double angle) {
    const auto [s, c] = sine_cosine(angle);
    return Place{length * c, length * s};
  };
  const auto plus = [](const Place& p, const Place& q) { return Place{p.x + q.x, p.y + q.y}; };
  // Along (sin, −cos) of an angle, as the benchmark often has it.
  const auto aside = [&](double length, double angle) { return polar(length, angle - pi / 2); };

  const Place o{0, 0};
  const Place a{xa, ya};
  const Place b{xb, yb};
  const Place c{xc, yc};
  const Place crank_pin = polar(rr, beta);
  const Place p = plus(crank_pin, polar(-d, beta + theta));
  const Place elbow = plus(a, polar(zt, delta));  // between K4 and K5
  const Place knee = plus(a, aside(u, epsilon));  // between K6 and K7
  const Place d_point = plus(b, plus(aside(sc, gamma), polar(sd, gamma)));

  struct Link {
    const char* name;
    double mass;
    double moment;
    Place centre;
    double angle;
    std::vector<Place> joints;  // its outline's corners
    double layer;
    Finish look;
  };
  const std::vector<Link> links{
      {"crank", 0.04325, 2.194e-6, polar(ra, beta), beta, {o, crank_pin}, 5, finish::terracotta},
      {"rod",
       0.00365,
       4.410e-7,
       plus(crank_pin, polar(-da, beta + theta)),
       beta + theta,
       {crank_pin, p},
       4,
       finish::ivory},
      {"lever",
       0.02373,
       5.255e-6,
       plus(b, plus(aside(sa, gamma), polar(sb, gamma))),
       gamma,
       {b, p, d_point},
       0,
       finish::teal},
      {"upper_link",
       0.00706,
       5.667e-7,
       plus(elbow, aside(e - ea, delta + phi)),
       phi + delta,
       {elbow, p},
       2,
       finish::mustard},
      {"upper_arm",
       0.07050,
       1.169e-5,
       plus(a, plus(polar(ta, delta), polar(tb, delta + pi / 2))),
       delta,
       {a, elbow},
       1,
       finish::blue},
      {"lower_link",
       0.00706,
       5.667e-7,
       plus(knee, polar(zf - fa, epsilon + omega)),
       omega + epsilon,
       {knee, p},
       3,
       finish::mustard},
      {"lower_arm",
       0.05498,
       1.912e-5,
       plus(a, plus(aside(ua, epsilon), polar(-ub, epsilon))),
       epsilon,
       {a, knee},
       1,
       finish::cherry},
  };
  const int brass = gltf.material(finish::brass);
  const int steel = gltf.material(finish::steel);
  std::vector<int> bodies;
  const auto local = [&](const Link& link, const Place& place) {
    const Pose pose{link.centre.point(), turn(Vector3::UnitZ(), link.angle).orientation};
    return pose.inverse() * place.point();
  };
  for (const Link& link : links) {
    const int body =
        gltf.node(link.name, {link.centre.point(), turn(Vector3::UnitZ(), link.angle).orientation}, plane);
    // It moves in the plane only: infinite moments across.
    gltf.motion(body, {.mass = link.mass, .inertia = Vector3(0, 0, link.moment * scale * scale)});
    const double z = 0.016 * link.layer;
    Mesh bars;
    Mesh pins;
    const std::size_t corners = link.joints.size();
    for (std::size_t i = 0; i < corners; ++i) {
      const Vector3 from = local(link, link.joints[i]);
      pins.add(rod(0.02, 0.013, 0.003, 20),
               Pose{from + Vector3(0, 0, z + 0.004), turn(Vector3::UnitX(), pi / 2).orientation});
      bars.add(rod(0.014, 0.024, 0.003, 28),
               Pose{from + Vector3(0, 0, z), turn(Vector3::UnitX(), pi / 2).orientation});
      if (corners == 2 && i == 1) break;
      const Vector3 to = local(link, link.joints[(i + 1) % corners]);
      const Vector3 along = to - from;
      bars.add(rounded(box({along.norm(), 0.028, 0.013}), 0.003, 2),
               Pose{(from + to) / 2 + Vector3(0, 0, z), Quaternion::FromTwoVectors(Vector3::UnitX(), along)});
    }
    if (corners == 2 && std::string_view(link.name) == "crank")
      bars.add(rod(0.014, 0.06, 0.003, 40),
               Pose{local(link, o) + Vector3(0, 0, z), turn(Vector3::UnitX(), pi / 2).orientation});
    const int bar_look = gltf.geometry(bars);
    const int pin_look = gltf.geometry(pins);
    const int paint = gltf.material(link.look);
    gltf.show(body, gltf.mesh(link.name, {{bar_look, paint}, {pin_look, brass}}));
    bodies.push_back(body);
  }

  // Every joint is a pin: two rows in the plane.
  const AxesLimit pin = locked(linear, {0, 1});
  const int pinned = gltf.joint_description({pin});
  const auto fixed = [&](const char* name, const Place& place) {
    return gltf.node(name, {place.point(), Quaternion::Identity()}, plane);
  };
  const auto on = [&](const char* name, int link, const Place& place) {
    // Parallel to the plane's frame.
    const Quaternion back = turn(Vector3::UnitZ(), -links[link].angle).orientation;
    return gltf.node(name, {local(links[link], place), back}, bodies[link]);
  };
  const auto add_pin = [&](const std::string& name, int first, int second, const Place& place) {
    const int held = on((name + "_eye").c_str(), second, place);
    gltf.joint(on(name.c_str(), first, place), held, pinned);
  };
  const auto add_bearing = [&](const std::string& name, int link, const Place& place) {
    const int held = fixed((name + "_bearing").c_str(), place);
    gltf.joint(on(name.c_str(), link, place), held, pinned);
  };
  // A motor that never comes near its speed turns with all its moment.
  const double moment = 0.033 * scale * scale / (slow * slow);
  const int driven = gltf.joint_description(
      {pin}, {{.kind = angular, .axis = 2, .velocity = 1e6, .damping = 1, .max_force = moment}});
  const int motor = fixed("motor", o);
  gltf.joint(motor, on("crank_axis", 0, o), driven);
  add_pin("crank_pin", 1, 0, crank_pin);
  add_pin("lever_pin", 2, 1, p);
  add_pin("upper_pin", 3, 1, p);
  add_pin("lower_pin", 5, 1, p);
  add_bearing("lever_axis", 2, b);
  add_pin("elbow", 4, 3, elbow);
  add_pin("knee", 6, 5, knee);
  add_bearing("upper_axis", 4, a);
  add_bearing("lower_axis", 6, a);
  const int spring = gltf.joint_description({{.kind = linear,
                                              .axes = {0, 1, 2},
                                              .min = 0.07785 * scale,
                                              .max = 0.07785 * scale,
                                              .stiffness = 4530 / (slow * slow)}});
  const int spring_end = on("spring_end", 2, d_point);
  const int spring_foot = fixed("spring_foot", c);
  gltf.joint(spring_foot, spring_end, spring);

  Mesh bearings;
  for (const Place& place : {o, a, b, c})
    bearings.add(rod(0.10, 0.016, 0.004, 24),
                 Pose{place.point() + Vector3(0, height, 0.02), turn(Vector3::UnitX(), pi / 2).orientation});
  const int bearing_look = gltf.geometry(bearings);
  gltf.show(gltf.node("bearings"), gltf.mesh("bearings", {{bearing_look, steel}}));

  // The seven angles at 0.03 s of the benchmark's time.
  constexpr double end_beta = 15.81077119629904, end_theta = -15.75637105984298,
                   end_gamma = 0.04082224013073101, end_phi = -0.5347301163226948,
                   end_delta = 0.5244099658805304, end_omega = 0.5347301163226948,
                   end_epsilon = 1.048080741042263;
  const std::array<double, 7> ends{end_beta,  end_beta + end_theta,    end_gamma,  end_phi + end_delta,
                                   end_delta, end_omega + end_epsilon, end_epsilon};
  for (std::size_t i = 0; i < links.size(); ++i) {
    gltf.expect_at(
        {std::string(links[i].name) + ": angle turned at 3 s", "angle", {links[i].name}, Vector3::UnitZ()}, 3,
        ends[i] - links[i].angle, i == 0 ? 0.15 : 0.05,
        "Test Set for IVP Solvers (Bari), Andrews' squeezing mechanism");
  }
  return gltf.text();
}

}  // namespace substep::scenes
