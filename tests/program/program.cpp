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

std::string line_of(const std::vector<std::string>& arguments) {
  std::string line;
  for (const std::string& argument : arguments) line.append(" ").append(quoted(argument));
  return line;
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
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
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
  outcome.out = content_of(out).value_or("");
  outcome.err = content_of(err).value_or("");
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

std::string Program::scene(const std::string& name) {
  return (fs::path(test::source_folder) / "scenes" / name).string();
}

std::string Program::system_path() {
  const char* const path = std::getenv("PATH");
  return path != nullptr ? path : "";
}

Outcome Program::run(const std::vector<std::string>& arguments, const std::string& path) const {
  return shell(line_of(arguments), path);
}

Outcome Program::shell(const std::string& words, const std::string& path) const {
  return run_command(fmt::format("cd {} && S={} && PATH={} {} {}", quoted(folder_.string()),
                                 quoted(scene("")), quoted(path), quoted(SUBSTEP_PROGRAM), words));
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

std::string Program::printed(const std::string& words) const {
  const Outcome outcome = shell(words);
  EXPECT_EQ(outcome.exit_code, 0) << words << "\n" << outcome.err;
  return outcome.out;
}

void Program::expect_refused(const std::vector<std::string>& arguments, const std::string& part) const {
  refuses(line_of(arguments), part);
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
