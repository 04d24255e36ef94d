#pragma once
/// The list of the fields of Settings, from which options of commands, pose logs, JSON, TOML keys, labels and
/// records of sweeps are made. A new field of Settings needs only a line in `settings_fields`.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sim/math/vector.h"
#include "sim/model/settings.h"

namespace substep {

struct SettingsField {
  using Member = std::variant<Algorithm Settings::*, int Settings::*, double Settings::*, Joints Settings::*>;

  /// The range of a number.
  struct Range {
    double low = -infinity;
    double high = infinity;
    bool has_low = true;   ///< `low` itself is allowed
    bool has_high = true;  ///< `high` itself is allowed
    std::string_view unit = {};

    bool contains(double value) const;  ///< false for NaN
    std::string text() const;           ///< "above 0 and at most 10 s"
  };

  /// The form of the field in labels and in names of files.
  struct Label {
    std::string_view symbol = {};  ///< before the value in labels: "n="
    std::string_view letter = {};  ///< before the value in names of files
    /// Fields of one group are left out of labels where all of them are as in Settings{}. 0: never.
    int group = 0;
  };

  std::string_view name;  ///< "substeps": the key in files and in --set
  Member member;
  std::string_view help;        ///< text for the help of commands
  std::string_view usual = {};  ///< its default in the help, where it is not one value
  Range range = {};
  Algorithm first = Algorithm::a1;  ///< the first algorithm that reads it
  Algorithm last = Algorithm::a5;   ///< the last algorithm that reads it
  Algorithm also = last;            ///< one more algorithm that reads it
  Label label = {};
  /// The field of all rows that this one overrides for contacts where it is not 0. A command that sets the
  /// field of all rows by its name resets this field and the others of its group to 0.
  std::string_view overrides = {};
  bool can_be_left_out = false;  ///< files omit it where it is as in Settings{}

  bool is_read_by(Algorithm algorithm) const {
    return (first <= algorithm && algorithm <= last) || algorithm == also;
  }
  bool is_left_out(const Settings& settings) const;  ///< true where files omit it
};

inline constexpr std::array<SettingsField, 16> settings_fields{{
    {.name = "algorithm",
     .member = &Settings::algorithm,
     .help = "Algorithm",
     .usual = "a3",
     .last = Algorithm::avbd},
    {.name = "step",
     .member = &Settings::step,
     .help = "Step h in seconds, such as 1/60",
     .usual = "the scene's",
     .range = {.low = 0, .high = 10, .has_low = false, .unit = " s"},
     .last = Algorithm::avbd,
     .label = {"h="}},
    {.name = "substeps",
     .member = &Settings::substeps,
     .help = "Sub-steps n of A3 to A5 and of Soft Step",
     .usual = "the scene's; of Soft Step 4",
     .range = {.low = 1, .high = 100000},
     .first = Algorithm::a3,
     .also = Algorithm::soft,
     .label = {"n=", "n"}},
    {.name = "iterations",
     .member = &Settings::iterations,
     .help = "Iterations m: of A2 and AVBD in a step, of A3 to A5 in a sub-step",
     .usual = "the scene's n of A2, in loops at least 200; of AVBD 10, else 1",
     .range = {.low = 1, .high = 100000},
     .first = Algorithm::a2,
     .also = Algorithm::avbd,
     .label = {"m=", "m"}},
    {.name = "tau",
     .member = &Settings::tau,
     .help = "Stabilization factor τ of A3 to A5, of all rows",
     .range = {.low = 0, .high = 4, .has_low = false},
     .first = Algorithm::a3,
     .label = {"τ=", "t", 1}},
    {.name = "kappa",
     .member = &Settings::kappa,
     .help = "Stabilization factor κ of A3 to A5, of all rows",
     .range = {.low = 0, .high = 2, .has_low = false},
     .first = Algorithm::a3,
     .label = {"κ=", "k", 1}},
    {.name = "contact_tau",
     .member = &Settings::contact_tau,
     .help = "τ of contacts in A3 to A5; as that of all rows where it is 0, or where tau or kappa is given "
             "alone",
     .range = {.low = 0, .high = 4},
     .first = Algorithm::a3,
     .label = {"/", "ct", 1},
     .overrides = "tau"},
    {.name = "contact_kappa",
     .member = &Settings::contact_kappa,
     .help = "κ of contacts in A3 to A5; as that of all rows where it is 0, or where tau or kappa is given "
             "alone",
     .range = {.low = 0, .high = 2},
     .first = Algorithm::a3,
     .label = {"/", "ck", 1},
     .overrides = "kappa"},
    {.name = "joints",
     .member = &Settings::joints,
     .help = "Joints in A3 to A5, row by row or in blocks",
     .usual = "stable; of A3 in most loops plain",
     .first = Algorithm::a3},
    {.name = "relaxation",
     .member = &Settings::relaxation,
     .help = "Over-relaxation ω of A2",
     .range = {.low = 0, .high = 2, .has_low = false, .has_high = false},
     .first = Algorithm::a2,
     .last = Algorithm::a2,
     .label = {"ω=", "w", 2}},
    {.name = "tolerance",
     .member = &Settings::tolerance,
     .help = "A2 ends a step when no row moves its velocity by more (m/s, rad/s); 0: never",
     .range = {.low = 0},
     .first = Algorithm::a2,
     .last = Algorithm::a2,
     .label = {"aw=", "a", 3}},
    {.name = "warm_start",
     .member = &Settings::warm_start,
     .help = "Fraction of the last impulses that a step of A2, or a sub-step of A3 to A5, starts from",
     .range = {.low = 0, .high = 1},
     .first = Algorithm::a2,
     .label = {"warm=", "ws", 4},
     .can_be_left_out = true},
    {.name = "contact_hertz",
     .member = &Settings::contact_hertz,
     .help = "Frequency of Soft Step's contacts in Hz, at most 1/8 of the sub-steps' rate",
     .range = {.low = 0, .high = 1e6, .has_low = false, .unit = " Hz"},
     .first = Algorithm::soft,
     .last = Algorithm::soft,
     .label = {"contacts=", "ch", 5},
     .can_be_left_out = true},
    {.name = "joint_hertz",
     .member = &Settings::joint_hertz,
     .help = "Frequency of Soft Step's joints in Hz, at most 1/4 of the sub-steps' rate",
     .range = {.low = 0, .high = 1e6, .has_low = false, .unit = " Hz"},
     .first = Algorithm::soft,
     .last = Algorithm::soft,
     .label = {"fj=", "jh", 6},
     .can_be_left_out = true},
    {.name = "alpha",
     .member = &Settings::alpha,
     .help = "Fraction α of a position error that a step of AVBD leaves",
     .range = {.low = 0, .high = 1},
     .first = Algorithm::avbd,
     .last = Algorithm::avbd,
     .label = {"α=", "al", 7},
     .can_be_left_out = true},
    {.name = "beta",
     .member = &Settings::beta,
     .help = "Growth β of AVBD's penalty with the error, N/m²",
     .range = {.low = 0, .high = 1e12},
     .first = Algorithm::avbd,
     .last = Algorithm::avbd,
     .label = {"β=", "b", 8},
     .can_be_left_out = true},
}};

/// Returns the value as text, "0.6" or "stable"; a number as the shortest decimals that keep its bits.
std::string text_of(const Settings& settings, const SettingsField& field);

/// Sets the field from text as of text_of(), in any range. Returns false, and sets nothing, for other text.
bool set(Settings& settings, const SettingsField& field, std::string_view text);

/// Returns a typed number, which may be a fraction: "0.01" or "1/60"; nothing for other text.
std::optional<double> fraction_in(std::string_view text);

/// Sets the field from typed text as set() does; a number may be a fraction.
bool set_typed(Settings& settings, const SettingsField& field, std::string_view text);

/// Copies the field's value of `from`.
void copy(Settings& settings, const SettingsField& field, const Settings& from);

/// Returns the kind of the field's values: "a whole number", "a number", "rows, plain or stable".
std::string kind_of(const SettingsField& field);

const SettingsField& field_named(std::string_view name);  ///< throws Error for an unknown name

/// A setting in labels: "n=4", "τ=0.6/0.9", "stable", "h=1/60".
struct SettingsPart {
  const SettingsField* field;
  std::string text;
};

/// Returns the settings that the algorithm reads and labels write, the step last.
std::vector<SettingsPart> parts_of(const Settings& settings);

/// Settings as text, as typed by users and printed by labels, "n=4,joints=stable,tau=0.6/0.9": keys and
/// values in the order of the text.
using TypedSettings = std::vector<std::pair<std::string, std::string>>;

/// Splits "n=4,joints=stable". Throws Error where a part is no KEY=VALUE.
TypedSettings typed_settings_in(std::string_view text);

/// Returns true where `key` is the field's name ("substeps") or its symbol in labels ("n").
bool is_called(const SettingsField& field, std::string_view key);

/// Sets the fields from their texts without checking ranges. Their order does not matter: τ and κ of contacts
/// come last, since τ and κ of all rows reset them. "tau=0.6/0.9" sets τ of joints and of contacts. Throws
/// Error for a value that cannot be read, for a field that is given twice, and for a key that is none of
/// `fields`, which it lists.
void set_typed(Settings& settings, const TypedSettings& typed,
               const std::vector<const SettingsField*>& fields);

/// Returns an explanation of all fields: key, symbol, meaning, range, default.
std::string settings_help();

}  // namespace substep
