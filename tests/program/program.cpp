#include "program.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "sim/log/file_output.h"
#include "tests/folders.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

std::string test_name() {
  const testing::TestInfo* const info = testing::UnitTest::GetInstance()->current_test_info();
  std::string name = std::string(info->test_suite_name()) + "." + info->name();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace

std::string quoted(const std::string& word) {
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

Program::Program() : folder_(fs::path(testing::TempDir()) / ("substep_" + test_name())) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
}

Program::~Program() {
  fs::remove_all(folder_);
}

std::string Program::scene(const std::string& name) {
  return (fs::path(test::source_folder) / "scenes" / name).string();
}

Outcome Program::command(const std::string& line) const {
  const fs::path out = folder_.string() + "_out";
  const fs::path err = folder_.string() + "_err";
  const std::string setting =
      fmt::format("export XDG_CACHE_HOME=/dev/null S={} P={}", quoted(scene("")), quoted(SUBSTEP_PROGRAM));
  const int status =
      std::system(fmt::format("( cd {} && {} && {} ) >{} 2>{} </dev/null", quoted(folder_.string()), setting,
                              line, quoted(out.string()), quoted(err.string()))
                      .c_str());
  Outcome outcome;
  // A signal shows as the shell shows it, 128 and its number.
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = content_of(out).value_or("");
  outcome.err = content_of(err).value_or("");
  fs::remove(out);
  fs::remove(err);
  return outcome;
}

Outcome Program::expect(const std::string& words, int exit_code, const std::vector<std::string>& out,
                        const std::vector<std::string>& err) const {
  SCOPED_TRACE(words);
  Outcome outcome = shell(words);
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  for (const std::string& part : out) EXPECT_THAT(outcome.out, testing::HasSubstr(part));
  for (const std::string& part : err) EXPECT_THAT(outcome.err, testing::HasSubstr(part));
  return outcome;
}

void Program::refuses(const std::string& words, const std::string& part) const {
  SCOPED_TRACE(words);
  const std::vector<std::string> before = files();
  const Outcome outcome = shell(words);
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

void Program::copy_scene(const std::string& name, const std::string& to) const {
  fs::copy(scene(name), folder_ / to);
}

std::string Program::content(const std::string& name) const {
  return content_of(folder_ / name).value_or("");
}

void Program::expect_content(const std::string& name, const std::vector<std::string>& parts,
                             const std::vector<std::string>& absent) const {
  SCOPED_TRACE(name);
  const std::string text = content(name);
  for (const std::string& part : parts) EXPECT_TRUE(text.find(part) != std::string::npos) << part;
  for (const std::string& part : absent) EXPECT_TRUE(text.find(part) == std::string::npos) << part;
}

std::vector<std::vector<std::string>> Program::table(const std::string& name) const {
  std::vector<std::vector<std::string>> lines;
  std::istringstream stream(content(name));
  for (std::string line; std::getline(stream, line);) {
    std::istringstream parts(line);
    lines.emplace_back();
    for (std::string field; std::getline(parts, field, ',');) lines.back().push_back(field);
  }
  return lines;
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
