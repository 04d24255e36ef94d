#include "program.h"
#include "tests/folders.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

namespace substep {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string test_name() {
  const testing::TestInfo* const info = testing::UnitTest::GetInstance()->current_test_info();
  std::string name = std::string(info->test_suite_name()) + "." + info->name();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace

std::string quoted(const std::string& word) {
  std::string result = "'";
  for (const char c : word) {
    if (c == '\'') {
      result.append("'\\''");
    } else {
      result.push_back(c);
    }
  }
  result.push_back('\'');
  return result;
}

Outcome run_command(const std::string& command) {
  const fs::path out = fs::path(testing::TempDir()) / ("substep_out_" + test_name());
  const fs::path err = fs::path(testing::TempDir()) / ("substep_err_" + test_name());
  const int status = std::system(fmt::format("( export XDG_CACHE_HOME=/dev/null; {} ) >{} 2>{} </dev/null",
                                             command, quoted(out.string()), quoted(err.string()))
                                     .c_str());
  Outcome outcome;
  // A signal shows as the shell shows it, 128 and its number.
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = read(out);
  outcome.err = read(err);
  fs::remove(out);
  fs::remove(err);
  return outcome;
}

Program::Program() : folder_(fs::path(testing::TempDir()) / ("substep_" + test_name())) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
}

Program::~Program() {
  fs::remove_all(folder_);
}

std::string Program::system_path() {
  const char* const path = std::getenv("PATH");
  return path != nullptr ? path : "";
}

std::string Program::scene(const std::string& name) {
  return (fs::path(test::source_folder) / "scenes" / name).string();
}

Outcome Program::run(const std::vector<std::string>& arguments, const std::string& path) const {
  std::string command =
      fmt::format("cd {} && PATH={} {}", quoted(folder_.string()), quoted(path), quoted(SUBSTEP_PROGRAM));
  for (const std::string& argument : arguments) command += fmt::format(" {}", quoted(argument));
  return run_command(command);
}

void Program::expect_refused(const std::vector<std::string>& arguments, const std::string& part) const {
  std::ostringstream line;
  for (const std::string& argument : arguments) line << argument << ' ';
  SCOPED_TRACE(line.str());
  const std::vector<std::string> before = files();
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, testing::HasSubstr(part));
  EXPECT_THAT(outcome.err, testing::StartsWith("substep: "));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(files(), before);
}

void Program::write(const std::string& name, const std::string& content) const {
  std::ofstream(folder_ / name, std::ios::binary) << content;
}

std::string Program::content(const std::string& name) const {
  return read(folder_ / name);
}

std::vector<std::string> Program::files() const {
  std::vector<std::string> result;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_)) {
    result.push_back(entry.path().lexically_relative(folder_).string());
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace substep
