/// Scenes with more joints than hold: hinges that say the same thing, a chain that cannot reach both its
/// eyes.

#include "closed_forms.h"
#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {

std::string door() {
  constexpr double lean = 0.25;
  constexpr double open = 1.3;
  const Vector3 leaf(0.8, 1.5, 0.05);
  constexpr double clearance = 0.06;  // from the axis to the leaf
  constexpr std::array<int, 4> counts{1, 2, 5, 10};
  constexpr std::array finishes{finish::terracotta, finish::mustard, finish::teal, finish::blue};

  GltfBuilder gltf("door", 4);
  gltf.poster(0.9);
  set_view(gltf, {1.5, 2.0, 6.0}, {0.25, 0.90, 0}, 0.50);

  const int hinge = gltf.hinge();
  // Boards with a frame and a brace, as a gate has.
  Mesh boards;
  for (int i = 0; i < 5; ++i)
    boards.add(rounded(box({leaf.x() / 5, leaf.y(), 0.03}), 0.006, 2), at(leaf.x() * (i - 2) / 5, 0, 0));
  Mesh braces;
  for (const double y : {-0.58, 0.58})
    braces.add(rounded(box({leaf.x(), 0.12, 0.05}), 0.008, 2), at(0, y, 0));
  braces.add(rounded(box({1.30, 0.10, 0.05}), 0.008, 2), turn(Vector3::UnitZ(), 0.97));
  const int board_look = gltf.geometry(boards);
  const int brace_look = gltf.geometry(braces);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const int count = counts[i];
    const std::string name = "hinges_" + std::to_string(count);
    const int frame = gltf.node(name + "_frame", at(1.25 * (static_cast<int>(i) - 1.5) - 0.35, 0.20, 0) *
                                                     turn(Vector3::UnitZ(), -lean));
    // The post leans towards where the gate hangs when it is closed.
    Mesh post;
    post.add(rounded(box({0.10, 1.80, 0.10}), 0.012), at(-0.10, 0.80, 0));
    Mesh foot;
    foot.add(rounded(box({0.36, 0.24, 0.36}), 0.02), turn(Vector3::UnitZ(), lean) * at(-0.10, -0.08, 0));
    Mesh pins;
    Mesh knuckles;
    std::vector<double> heights;
    for (int j = 0; j < count; ++j) heights.push_back(count == 1 ? 0.8 : 0.2 + 1.2 * j / (count - 1));
    for (const double y : heights) {
      pins.add(rod(0.09, 0.016, 0.003, 16), at(0, y, 0));
      pins.add(rounded(box({0.10, 0.03, 0.03}), 0.006, 1), at(-0.04, y - 0.025, 0));
      knuckles.add(rod(0.035, 0.028, 0.004, 20), at(-leaf.x() / 2 - clearance, y - 0.8 + 0.018, 0));
      knuckles.add(rounded(box({0.22, 0.03, 0.06}), 0.006, 1),
                   at(-leaf.x() / 2 - clearance + 0.11, y - 0.8 + 0.018, 0));
    }
    const int post_look = gltf.geometry(post);
    const int foot_look = gltf.geometry(foot);
    const int pin_look = gltf.geometry(pins);
    const int walnut = gltf.material(finish::walnut);
    const int granite = gltf.material(finish::granite);
    const int iron = gltf.material(finish::iron);
    gltf.show(frame,
              gltf.mesh(name + "_post", {{post_look, walnut}, {foot_look, granite}, {pin_look, iron}}));

    const int body =
        gltf.node(name, turn(Vector3::UnitY(), -open) * at(clearance + leaf.x() / 2, 0.8, 0), frame);
    gltf.motion(body, {.mass = 20, .inertia = box_inertia(20, leaf)});
    const int knuckle_look = gltf.geometry(knuckles);
    const int paint = gltf.material(finishes[i]);
    const int maple = gltf.material(finish::maple);
    gltf.show(body, gltf.mesh(name, {{board_look, paint}, {brace_look, maple}, {knuckle_look, iron}}));
    // Z of a hinge is its axis.
    const Pose axis = turn(Vector3::UnitX(), -pi / 2);
    for (std::size_t j = 0; j < heights.size(); ++j) {
      const std::string number = name + "_" + std::to_string(j + 1);
      const int fixed = gltf.node(number + "_pin", at(0, heights[j], 0) * axis, frame);
      gltf.joint(gltf.node(number, at(-leaf.x() / 2 - clearance, heights[j] - 0.8, 0) * axis, body), fixed,
                 hinge);
    }
  }

  const double lever = clearance + leaf.x() / 2;
  const double moment = 20 * ((leaf.x() * leaf.x() + leaf.z() * leaf.z()) / 12 + lever * lever);
  const auto [sine, cosine] = sine_cosine(lean);
  const double period = pendulum_period(moment, 20, 9.81 * sine, lever, open);
  for (const int count : counts) {
    const std::string name = "hinges_" + std::to_string(count);
    gltf.expect_crossing({name + ": period", "angular_velocity", {name}, Vector3(sine, cosine, 0)}, 2, period,
                         0.02 * period,
                         "a pendulum in the field g sin 0.25: T = 4 √(I/(m g sin 0.25 l)) K(sin 0.65)");
  }
  return gltf.text();
}

std::string short_chain() {
  constexpr double length = 0.5;
  constexpr double height = 1.1;
  constexpr double span = 2;
  constexpr std::array finishes{finish::terracotta, finish::ivory, finish::teal};

  GltfBuilder gltf("short_chain", 4);
  gltf.poster(0.05);
  set_view(gltf, {0.6, 1.35, 4.0}, {0, 0.72, 0}, 0.52);

  std::array<int, 2> anchors{};
  for (const int side : {-1, 1}) {
    const std::array<ProfilePoint, 9> column{{{0, 0},
                                              {0.22, 0, 0.01},
                                              {0.22, 0.05, 0.02},
                                              {0.06, 0.065, 0.03},
                                              {0.03, 0.17, 0.08},
                                              {0.03, height - 0.07, 0.01},
                                              {0.055, height - 0.05, 0.01},
                                              {0.055, height + 0.05, 0.03},
                                              {0, height + 0.06}}};
    const std::string name = side < 0 ? "left_post" : "right_post";
    const int post = gltf.node(name, at(side * (span / 2 + 0.055), 0, 0));
    const int column_look = gltf.geometry(turned(column, 32));
    const int eye = gltf.geometry(Mesh().add(ball(0.045, 28), at(-side * 0.055, height, 0)));
    const int iron = gltf.material(finish::iron);
    gltf.show(post, gltf.mesh(name, {{column_look, iron}, {eye, gltf.material(finish::brass)}}));
    anchors[side > 0] = gltf.node(name + "_eye", at(-side * 0.055, height, 0), post);
  }

  // Three links of 0.5 m between eyes 2 m apart: none of the four joints can close but for the others' sake.
  const Mesh shaft = Mesh().add(rod(length - 0.05, 0.026, 0.006), turn(Vector3::UnitZ(), pi / 2));
  const Mesh ends =
      Mesh().add(ball(0.045, 28), at(-length / 2, 0, 0)).add(ball(0.045, 28), at(length / 2, 0, 0));
  const int shaft_look = gltf.geometry(shaft);
  const int end_look = gltf.geometry(ends);
  const int joint = gltf.ball_joint();
  int connected = anchors[0];
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i + 1);
    const int body = gltf.node("link_" + number, at(-span / 2 + length * (i + 0.5), height, 0));
    gltf.motion(body, {.mass = 1, .inertia = Vector3(1.0 / 2400, 1.0 / 48, 1.0 / 48)});
    const int paint = gltf.material(finishes[i]);
    gltf.show(body,
              gltf.mesh("link_" + number, {{shaft_look, paint}, {end_look, gltf.material(finish::brass)}}));
    const int head = gltf.node("joint_" + number, at(-length / 2, 0, 0), body);
    gltf.joint(head, connected, joint);
    connected = gltf.node("end_" + number, at(length / 2, 0, 0), body);
    if (i == 2) gltf.joint(connected, anchors[1], joint);
  }
  return gltf.text();
}

}  // namespace substep::scenes
