#pragma once
/// s1, geometry: the contacts of a step.

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/time_of_impact.h"
#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

/// Motion on both bodies, and slip in a step, below which a contact point counts as the cached one, relative
/// to the smaller shape. A fast rolling body has another point in each step: the distance rolled would count
/// as displacement, by up to a sixth of the squared angle.
inline constexpr double same_place = 0.02;

/// Least cosines of the angle between directions of one face that is tilted a little, and between equal ones.
inline constexpr double cosine_of_tilt = 0.999;
inline constexpr double same_direction = 1 - 1e-12;

/// Gap at which shapes touch, relative to the smaller.
inline constexpr double touching = 2e-4;

/// Gaps at which shapes that touched before still touch, relative to the smaller shape and to the fall in a
/// step. A pile that settles trembles by as much.
inline constexpr double touched_before = 0.05;
inline constexpr double falls_of_touched = 4;

/// Path in the step that an impact must take from a body to be solved at once, bouncing or not, relative to
/// the smaller shape.
inline constexpr double hard = 0.01;

/// Extra distance at which points are found so that a patch can be kept, relative to the smaller shape.
inline constexpr double spare_margin = 2e-3;

/// Path in the step that an impact must take from a body to turn it aside, relative to the smaller shape.
inline constexpr double aside = 0.25;

/// Coefficients of a pair, combined from two materials.
struct PairMaterial {
  PairMaterial(const ContactMaterial& one, const ContactMaterial& other);
  double dynamic_friction;
  double static_friction;
  double restitution;
};

/// Finds the contacts of a step. Keeps its arrays from step to step, not its results.
///
/// Shapes that touch are in contact. Separate shapes are in contact if they meet within the duration under
/// gravity alone. Such a contact has the plane and the points of the meeting, so that the plane of a corner
/// does not stop a body that misses the corner. missed() finds the meetings of bodies to which other contacts
/// give another motion.
class ContactFinder {
 public:
  /// `reformulates`: sub-steps formulate the contacts' rows anew, so that normals turn with the bodies (A3).
  ContactFinder(const Scene& scene, const Model& model, bool reformulates = false);

  /// Returns the contacts of `duration` seconds in `substeps` sub-steps from a state, with the friction and
  /// the overlaps of its contact cache. `aligned`: the first tangent is along the slip velocity with gravity,
  /// where there is any; else it depends on the normal alone. `part`: fraction of the step that the duration
  /// is. `all`: all near shapes are in contact, with the planes of the start.
  const std::vector<Contact>& find(const State& state, double duration, int substeps, bool aligned = false,
                                   double part = 1, bool all = false);

  /// Returns the patches of the step before that still hold: their bodies have moved by less than 1e-3 of the
  /// smaller shape's size relative to each other since the patch was found. The contacts of the last find()
  /// do not include their points.
  std::vector<PatchShape>& kept_patches() { return kept_; }

  /// Returns the time in [0, duration] from which the contacts of the last find() are incomplete: other
  /// bodies meet by the motion from `begin` to `end` and would overlap by more than `tolerated_overlap`.
  /// Nothing where they are complete. `begin`: the coordinates of the last find().
  std::optional<double> missed(const std::vector<Coordinates>& begin, const std::vector<Coordinates>& end,
                               double duration);

  /// Returns whether a body touches another in the last contacts without an impact.
  bool is_at_rest(int body) const { return is_at_rest_[body]; }

  /// Returns a body's acceleration by gravity, m/s².
  Vector3 fall_of(int body) const {
    if (model_.masses[body].inverse_mass == 0) return Vector3::Zero();
    return model_.gravity * model_.masses[body].gravity_factor;
  }

  /// Returns the time of the first impact among the last contacts that turns a body aside, or infinity.
  double first_impact() const { return first_impact_; }

  /// Returns the time of the first impact among the last contacts that must be solved when it happens, or
  /// infinity: of a body that turns by more than 0.02 rad in the duration, whose tangents change until then;
  /// and a fast one without restitution in a single sub-step, which would only close the gap.
  double first_timed_impact() const { return first_timed_impact_; }

  /// Largest overlap of a body that an impact turned aside with another one, relative to the smaller shape.
  static constexpr double tolerated_overlap = 0.01;

  /// Returns true where two colliders can touch: one of them moves, and no joint or filter excludes the pair.
  bool may_meet(std::uint32_t i, std::uint32_t j) const;

 private:
  struct Candidate {
    const Collider* collider;
    double reach;  ///< of the shape's farthest point from the body's centre of mass, m
    double size;   ///< of the shape, m; infinite for planes
    bool curved;   ///< not flat everywhere
  };
  /// A meeting of two separate colliders.
  struct Meeting {
    std::uint32_t a;
    std::uint32_t b;
    double time;        ///< s
    bool is_impact;     ///< an impulse acts at once
    bool turns_aside;   ///< the impact is fast enough to deflect a body
    bool separates;     ///< the two touch, and separate
    std::size_t group;  ///< its contacts
  };
  /// The contacts of one pair of colliders.
  struct Group {
    std::size_t begin;
    std::size_t end;
    Vector3 normal;                ///< of the first, world
    std::array<int, 2> colliders;  ///< a and b
    /// For each, the group before it with that collider; −1: none.
    std::array<int, 2> earlier{-1, -1};
    bool dropped = false;
    int patch = -1;  ///< kept_[patch]; −1: its contacts were found now
    int points;
    Vector3 arm_a;  ///< of the first contact, or of the patch's centre
    Vector3 arm_b;
  };
  int body_of(std::uint32_t i) const { return candidates_[i].collider->body; }
  double smaller_size(std::uint32_t a, std::uint32_t b) const {
    return std::min(candidates_[a].size, candidates_[b].size);
  }
  double margin_of(std::uint32_t a, std::uint32_t b) const;
  MovingShape moving(std::uint32_t i, const std::vector<RigidMotion>& motions) const;
  void find_pair(std::uint32_t a, std::uint32_t b);
  std::optional<Impact> take_ahead(std::uint32_t a, std::uint32_t b, double gap, double margin);
  void find_met(std::uint32_t a, std::uint32_t b, double time, double margin,
                std::vector<ContactPoint>& points) const;
  void add_meeting(std::uint32_t a, std::uint32_t b, const Impact& impact);
  struct Pair;
  Pair pair_of(std::uint32_t a, std::uint32_t b, double time) const;
  void add_contacts(std::uint32_t a, std::uint32_t b, double time);
  void set_impact(const Pair& pair, const ContactPoint& point, const Vector3& velocity, double slip_speed,
                  Contact& contact);
  void set_meeting(const Pair& pair, const ContactPoint& point, Contact& contact) const;
  void recall(const Pair& pair, const ContactPoint& point, double slip_speed, Contact& contact) const;
  const PatchShape* patch_of(std::uint32_t a, std::uint32_t b) const;
  bool keep_patch(const PatchShape& patch, double margin);
  bool pass(const MovingShape& a, const MovingShape& b, double time, double size);
  double depth_after(const MovingShape& a, const MovingShape& b, double time);
  void keep_first_impacts();
  void add_neighbours();
  void drop_flush();
  void remove_dropped();
  bool is_flush(int collider, const Group& floor, const Group& other) const;
  std::optional<Vector3> face_towards(std::uint32_t collider, const Quaternion& orientation,
                                      const Vector3& direction, double cosine) const;
  double recovered(const Contact& contact) const;
  void set_rolling(const ContactPoint& point, const Pose& pose_a, const Pose& pose_b, Contact& contact) const;
  void list_remembered();
  std::span<const ContactMemory> remembered_of(std::uint32_t a, std::uint32_t b) const;
  void recall_point(std::span<const ContactMemory> remembered, double overlap, double slip,
                    Contact& contact) const;
  void recall_patch(const PatchShape& patch, const Vector3& slip, double overlap, Contact& contact) const;

  const Model& model_;
  bool reformulates_;
  std::vector<Candidate> candidates_;
  const State* state_ = nullptr;  ///< of the last find()
  bool aligned_ = false;
  double duration_ = 0;
  double fall_ = 0;  ///< by gravity in the duration, twice, m
  double part_ = 1;
  bool all_ = false;
  double substep_ = 0;
  double whole_substep_ = 0;  ///< of a step that is not taken in parts
  std::vector<Pose> poses_;
  std::vector<Bounds> bounds_;
  std::vector<double> margins_;       ///< by collider, m: of its turning and fall
  std::vector<Matrix3> rotations_;    ///< by body
  std::vector<RigidMotion> motions_;  ///< by body, under gravity alone
  std::vector<RigidMotion> moved_;    ///< by body, as they have moved
  std::vector<bool> is_at_rest_;      ///< by body: it touches another without an impact
  std::vector<bool> is_deflected_;    ///< by body: it has moved otherwise than under gravity alone
  std::vector<bool> is_left_out_;  ///< by body: an impact comes before one of its contacts, which is left out
  BroadPhase broad_phase_;
  BroadPhase::Pairs pairs_;
  BroadPhase::Pairs touching_;    ///< pairs with contacts, ascending
  BroadPhase::Pairs neighbours_;  ///< pairs that are near and will not meet
  std::vector<bool> is_pushed_;   ///< by body: it touches another moving one
  std::vector<Meeting> meetings_;
  std::vector<Group> groups_;
  std::vector<int> group_of_;       ///< by collider: the last of its groups; −1: none
  std::vector<double> earliest_;    ///< by body: of its meetings that turn it aside
  double approach_ = 0;             ///< of the last pair, beyond the resting speed, if it is an impact, m/s
  bool separates_ = false;          ///< the last pair separates
  double first_bounce_ = infinity;  ///< time within which the first touching pair has its impact, s
  double first_impact_ = infinity;
  double first_timed_impact_ = infinity;
  std::vector<int> begins_;        ///< by collider a: of its points in State::contacts
  std::vector<int> patch_begins_;  ///< by collider a: of its patches in `patches_of_`
  std::vector<int> patches_of_;    ///< indices of State::patches
  std::vector<PatchShape> kept_;
  std::vector<ContactPoint> points_;
  std::vector<ContactPoint> ahead_;     ///< of a mesh that a body touches, and which it meets later
  std::vector<ContactPoint> held_;      ///< the others of that mesh
  std::vector<ContactPoint> overlaps_;  ///< of depth_after()
  std::vector<Contact> contacts_;
};

}  // namespace substep
