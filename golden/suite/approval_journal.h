#pragma once
/// Makes approving a case all or nothing.
///
/// A case's goldens are several files, and no file system renames several at once. So all that will be new is
/// first written to one file beside the suite, `.<case>.approval`. Once that has its name, the case has its
/// new goldens: whoever reads goldens next puts in place what is not there yet. Before that, it has its old
/// ones. Interrupted at any point, a case never shows some of both.

#include <filesystem>
#include <span>
#include <string>

namespace substep {

struct NewGolden {
  std::filesystem::path file;
  std::string content;
};

/// Puts the files, all below the suite's folder, in the place of the case's goldens. Throws Error.
void replace_goldens(const std::filesystem::path& suite_folder, const std::string& case_name,
                     std::span<const NewGolden> files);

/// Does what an interrupted replace_goldens() left to do. To be called before goldens are read; several
/// processes may at once. Throws Error when what was left is damaged, or would write elsewhere.
void finish_approvals(const std::filesystem::path& suite_folder);

}  // namespace substep
