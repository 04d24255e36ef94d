#pragma once
/// Runs the real program in a folder of its own.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace substep {

struct Outcome {
  int exit_code = 0;
  std::string out;
  std::string err;
};

class Program : public testing::Test {
 protected:
  Program();
  ~Program() override;

  /// Runs a shell's command line in folder(). $P is the program, $S the folder of the repository's scenes.
  Outcome command(const std::string& line) const;
  /// Runs `substep` with the words of a command line.
  Outcome shell(const std::string& words) const { return command("$P " + words); }
  /// Runs `substep` like shell(), and expects an exit code and texts on both streams.
  Outcome expect(const std::string& words, int exit_code, const std::vector<std::string>& out,
                 const std::vector<std::string>& err = {}) const;
  /// Runs `substep` like shell(), expects exit code 0 and returns its output.
  std::string printed(const std::string& words) const { return expect(words, 0, {}).out; }
  /// Expects exit code 2, one line on stderr that holds `part`, nothing on stdout, and no new file.
  void refuses(const std::string& words, const std::string& part) const;

  /// Writes a file in folder().
  void write(const std::string& name, const std::string& content) const;
  /// Copies a scene of the repository to folder(), or to a file in it.
  void copy_scene(const std::string& name, const std::string& to = ".") const;
  std::string content(const std::string& name) const;
  /// Expects texts in a file in folder(), and others that it does not hold.
  void expect_content(const std::string& name, const std::vector<std::string>& parts,
                      const std::vector<std::string>& absent = {}) const;
  /// Returns the lines of a CSV file in folder(), each as its fields.
  std::vector<std::vector<std::string>> table(const std::string& name) const;
  bool has(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
  std::vector<std::string> files() const;  ///< in folder(), with those in folders in it, sorted

  const std::filesystem::path& folder() const { return folder_; }
  static std::string scene(const std::string& name);  ///< the path of a scene of the repository

 private:
  std::filesystem::path folder_;
};

/// Returns the text, quoted as one word of a shell.
std::string quoted(const std::string& word);

}  // namespace substep
