#pragma once
/// The one list of the fields of Settings. Options of commands, pose logs, JSON, TOML keys, labels and
/// records of sweeps are all made from it: a field that is added to Settings gets a line in
/// `settings_fields`, and no other.

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "sim/model/settings.h"

namespace substep {

struct SettingsField {
  using Member = std::variant<Algorithm Settings::*, int Settings::*, double Settings::*, Joints Settings::*>;

  /// The values a number may have.
  struct Range {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    bool has_low = true;   ///< `low` itself is allowed
    bool has_high = true;  ///< and `high`
    std::string_view unit = {};

    bool contains(double value) const;  ///< not of a NaN
    std::string text() const;           ///< "above 0 and at most 10 s"
  };

  std::string_view name;  ///< "substeps": the key in files and in --set
  Member member;
  std::string_view help;        ///< what it is, for people
  std::string_view usual = {};  ///< its default, for the help, where that is not one value
  Range range = {};
  Algorithm first = Algorithm::a1;  ///< the first algorithm that reads it
  Algorithm last = Algorithm::a5;   ///< and the last
  std::string_view symbol = {};     ///< before the value in labels: "n="
  std::string_view letter = {};     ///< the same in names of files
  /// Fields of one group are left out of labels where all of them are as in Settings{}. 0: always said.
  int group = 0;
  /// The field that this one stands in for where it is not 0. Who sets that one by its name sets it for all:
  /// then this one and the others of its group are 0, until they are set themselves.
  std::string_view stands_in_for = {};

  bool is_read_by(Algorithm algorithm) const { return first <= algorithm && algorithm <= last; }
};

inline constexpr std::array<SettingsField, 11> settings_fields{{
    {.name = "algorithm", .member = &Settings::algorithm, .help = "Algorithm"},
    {.name = "step",
     .member = &Settings::step,
     .help = "Step h in seconds, such as 1/60",
     .usual = "the scene's",
     .range = {.low = 0, .high = 10, .has_low = false, .unit = " s"},
     .symbol = "h="},
    {.name = "substeps",
     .member = &Settings::substeps,
     .help = "Sub-steps n of A3 to A5",
     .usual = "the scene's",
     .range = {.low = 1, .high = 100000},
     .first = Algorithm::a3,
     .symbol = "n=",
     .letter = "n"},
    {.name = "iterations",
     .member = &Settings::iterations,
     .help = "Iterations m: of A2 in a step, of A3 to A5 in a sub-step",
     .usual = "the scene's n of A2, else 1",
     .range = {.low = 1, .high = 100000},
     .first = Algorithm::a2,
     .symbol = "m=",
     .letter = "m"},
    {.name = "tau",
     .member = &Settings::tau,
     .help = "Stabilization factor τ of A3 to A5, of all rows",
     .range = {.low = 0, .high = 4, .has_low = false},
     .first = Algorithm::a3,
     .symbol = "τ=",
     .letter = "t",
     .group = 1},
    {.name = "kappa",
     .member = &Settings::kappa,
     .help = "Stabilization factor κ of A3 to A5, of all rows",
     .range = {.low = 0, .high = 2, .has_low = false},
     .first = Algorithm::a3,
     .symbol = "κ=",
     .letter = "k",
     .group = 1},
    {.name = "contact_tau",
     .member = &Settings::contact_tau,
     .help = "τ of contacts in A3 to A5; as that of all rows where it is 0, or where tau or kappa is given "
             "alone",
     .range = {.low = 0, .high = 4},
     .first = Algorithm::a3,
     .symbol = "/",
     .letter = "ct",
     .group = 1,
     .stands_in_for = "tau"},
    {.name = "contact_kappa",
     .member = &Settings::contact_kappa,
     .help = "κ of contacts in A3 to A5; as that of all rows where it is 0, or where tau or kappa is given "
             "alone",
     .range = {.low = 0, .high = 2},
     .first = Algorithm::a3,
     .symbol = "/",
     .letter = "ck",
     .group = 1,
     .stands_in_for = "kappa"},
    {.name = "joints",
     .member = &Settings::joints,
     .help = "Joints in A3 to A5, row by row or in blocks",
     .first = Algorithm::a3},
    {.name = "relaxation",
     .member = &Settings::relaxation,
     .help = "Over-relaxation ω of A2",
     .range = {.low = 0, .high = 2, .has_low = false, .has_high = false},
     .first = Algorithm::a2,
     .last = Algorithm::a2,
     .symbol = "ω=",
     .letter = "w",
     .group = 2},
    {.name = "tolerance",
     .member = &Settings::tolerance,
     .help = "A2 ends a step when no row moves its velocity by more (m/s, rad/s); 0: never",
     .range = {.low = 0},
     .first = Algorithm::a2,
     .last = Algorithm::a2,
     .symbol = "aw=",
     .letter = "a",
     .group = 3},
}};

/// The value as text; of a number the shortest decimals that read back to the same bits. "0.6", "stable".
std::string text_of(const Settings& settings, const SettingsField& field);

/// Sets the field from such a text, whatever its range. False, and nothing set, where no value reads so.
bool set(Settings& settings, const SettingsField& field, std::string_view text);

/// The number that was typed, which may be a fraction: "0.01" or "1/60".
std::optional<double> fraction_in(std::string_view text);

/// Sets the field from what was typed for it: as set(), and a number may be a fraction.
bool set_typed(Settings& settings, const SettingsField& field, std::string_view text);

/// Sets the field as it is in `from`.
void copy(Settings& settings, const SettingsField& field, const Settings& from);

/// What the field's values are: "a whole number", "a number", "rows, plain or stable".
std::string kind_of(const SettingsField& field);

const SettingsField& field_named(std::string_view name);  ///< of the list; throws Error for another

}  // namespace substep
