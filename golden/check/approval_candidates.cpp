#include "golden/check/approval_candidates.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

void add_candidate(CheckedCase& checked, const fs::path& from, const fs::path& to) {
  checked.candidates.push_back({from, content_hash(read_bytes(from)), to,
                                fs::exists(to) ? content_hash(read_bytes(to)) : std::string()});
}

void add_log_candidates(CaseContext& work, CheckedCase& checked) {
  if (!work.live) return;
  const SuiteCase& entry = work.result.entry;
  const std::string text = to_text(*work.live);
  const bool is_another = !work.result.poses.has_golden || text != read_bytes(entry.pose_file);
  // A run within its tolerance is no reason for another golden.
  const bool is_wanted =
      !work.result.poses.passes || work.result.poses.motion.judgement == PoseJudgement::exact;
  if (is_wanted && is_another)
    add_candidate(checked, work.folder.write("actual.poses", text), entry.pose_file);
  if (is_wanted && !has_equal_track(work)) {
    add_candidate(checked, work.folder.write("actual.track", to_bytes(*work.live_track)), entry.track_file);
  }
}

}  // namespace

bool has_equal_track(const CaseContext& work) {
  return work.golden_track && to_bytes(*work.golden_track) == to_bytes(*work.live_track);
}

std::string approved_track_hash(const CaseContext& work) {
  return content_hash(has_equal_track(work) ? read_bytes(work.result.entry.track_file)
                                            : to_bytes(*work.live_track));
}

void prepare_approval(CaseContext& work, CheckedCase& checked) {
  const SuiteCase& entry = work.result.entry;
  std::string& refusal = checked.result.refusal;
  add_log_candidates(work, checked);
  if (!work.result.poses.is_checked || (!work.result.images_checked && !entry.images.empty())) {
    refusal = fmt::format(
        "only half of it was checked, and poses and pictures are approved together: 'substep check --case "
        "{}'",
        entry.name);
    return;
  }
  const bool from_live = !work.new_images.empty();
  std::vector<ApprovablePicture> pictures;
  for (std::size_t i = 0; i < entry.images.size(); ++i) {
    const ImageResult& image = work.result.images[i];
    const Drawing& drawing = from_live ? work.new_images[i] : work.drawn[i];
    if (!drawing.is_there()) {
      refusal = fmt::format("the run has no frame {}: it ended \"{}\"", image.frame, work.live->end);
      return;
    }
    if (is_blank(drawing.picture)) {
      refusal = fmt::format("frame {} is blank", image.frame);
      return;
    }
    pictures.push_back({&drawing.picture, body_extents(drawing.bodies)});
    const std::string file_name = fmt::format("f{:04}.{}.png", image.frame, from_live ? "new" : "actual");
    const bool is_unchanged =
        image.passes && !from_live
            ? true
            : image.has_golden && render::read_png(entry.image_file(image.frame)).rgb == drawing.picture.rgb;
    if (is_unchanged) continue;
    add_candidate(checked, work.result.files / file_name, entry.image_file(image.frame));
  }
  const ApprovableRun run{&*work.live, content_hash(to_text(*work.live)), approved_track_hash(work)};
  checked.sidecar = make_sidecar(entry, run, work.scene, pictures, work.made_with);
  if (!entry.images.empty() && !work.made_with.is_pinned && !entry.any_renderer) {
    refusal = "it was drawn by " + work.made_with.renderer + ", which is not the pinned renderer";
  }
}

}  // namespace substep::golden
