#include "golden/review/review.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "golden/approval/approve.h"
#include "golden/check/check_results.h"
#include "golden/report/report.h"
#include "golden/report/report_assets.h"
#include "golden/review/http_request.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int seconds_to_wait = 10;  // for the rest of a request

class Descriptor {
 public:
  explicit Descriptor(int of) : of_(of) {}
  ~Descriptor() {
    if (of_ >= 0) ::close(of_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return of_; }

 private:
  int of_;
};

std::string unguessable_word() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Error("the system gives no random bytes");
  }
  std::string word;
  for (const unsigned char byte : bytes) word += fmt::format("{:02x}", byte);
  return word;
}

std::string received(int connection) {
  std::string bytes;
  std::size_t length = 0;
  while (length == 0 || bytes.size() < length) {
    std::array<char, 8192> part{};
    const ssize_t got = ::recv(connection, part.data(), part.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw Error("a request that is cut short");
    bytes.append(part.data(), static_cast<std::size_t>(got));
    if (length == 0) length = request_length(bytes);
  }
  return bytes.substr(0, length);
}

void send_all(int connection, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return;  // it went away
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

/// A refusal that the page shows.
struct Refused {
  int status;
  std::string why;
};

class Reviewer {
 public:
  Reviewer(const ReviewOptions& options, int port)
      : options_(options), host_(fmt::format("127.0.0.1:{}", port)), word_(unguessable_word()) {
    const Json results = read_results_json(options.output);
    for (const Json& entry : results.at("cases")) {
      if (entry.at("verdict") != "pass") found_.left.push_back(entry.at("name"));
    }
  }

  std::string address() const { return fmt::format("http://{}/{}/", host_, word_); }
  bool is_done() const { return is_done_ || found_.left.empty(); }
  const Review& found() const { return found_; }

  std::string answer(const HttpRequest& request) {
    try {
      return answer_or_refuse(request);
    } catch (const Refused& refused) {
      return http_answer(refused.status, "application/json", Json{{"error", refused.why}}.dump());
    } catch (const Error& error) {
      return http_answer(409, "application/json", Json{{"error", error.what()}}.dump());
    } catch (const Json::exception&) {
      return http_answer(400, "application/json", R"({"error":"not what the page sends"})");
    }
  }

 private:
  std::string answer_or_refuse(const HttpRequest& request) {
    // Another name for this address is another site's, which a browser was led here by.
    if (request.header("host") != host_) throw Refused{403, "another host"};
    const std::string start = "/" + word_ + "/";
    if (!request.target.starts_with(start)) throw Refused{404, "not here"};
    const std::string what = request.target.substr(start.size());
    if (request.method == "GET") return what.empty() ? page() : linked(what);
    if (request.method != "POST") throw Refused{405, "not that way"};
    if (request.header("origin") != "http://" + host_) throw Refused{403, "from another page"};
    if (what == "done") {
      is_done_ = true;
      return left_answer();
    }
    const Json body = Json::parse(request.body);
    const auto cases = body.at("cases").get<std::vector<std::string>>();
    const auto reason = body.at("reason").get<std::string>();
    if (reason.find_first_not_of(" \t\n") == std::string::npos) throw Refused{400, "a reason is needed"};
    if (what == "approve") {
      approve_cases(cases, reason, body.value("alternate", false));
    } else if (what == "reject") {
      reject_cases(cases, reason);
    } else {
      throw Refused{404, "not here"};
    }
    return left_answer();
  }

  std::string left_answer() const {
    return http_answer(200, "application/json", Json{{"left", found_.left}}.dump());
  }

  /// The report, with what lets it ask this process and nobody else.
  std::string page() const {
    std::string text = read_bytes(report_file(options_.output));
    const std::string_view policy = "default-src 'none'; ";
    const std::size_t at = text.find(policy);
    if (at == std::string::npos)
      throw Refused{409, "the report is of another version: run 'substep check' again"};
    text.insert(at + policy.size(), "connect-src 'self'; ");
    text.insert(text.rfind("</body>"),
                fmt::format("<script>\n{}</script>\n", report_assets::review_script()));
    return http_answer(200, "text/html; charset=utf-8", text);
  }

  /// What the report links to: a PNG file in a case's folder, or the page that plays the case, which may do
  /// nothing but that: it is a page of another origin, which approves nothing.
  std::string linked(const std::string& name) const {
    const bool is_plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
    });
    const fs::path path = name;
    if (!is_plain || path.is_absolute() || name.find("..") != std::string::npos ||
        (path.extension() != ".png" && path.filename() != "player.html") ||
        !fs::is_regular_file(options_.output / path)) {
      throw Refused{404, "not here"};
    }
    if (path.extension() == ".html") {
      return http_answer(
          200, "text/html; charset=utf-8", read_bytes(options_.output / path),
          "Content-Security-Policy: sandbox allow-scripts allow-downloads; default-src 'none'; "
          "script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: data:\r\n");
    }
    return http_answer(200, "image/png", read_bytes(options_.output / path));
  }

  void expect_left(const std::vector<std::string>& cases) const {
    if (cases.empty()) throw Refused{400, "no case is named"};
    for (const std::string& name : cases) {
      if (std::find(found_.left.begin(), found_.left.end(), name) == found_.left.end()) {
        throw Refused{409, name + " is not one that is left"};
      }
    }
  }

  void take(const std::vector<std::string>& cases, std::vector<std::string>& to) {
    for (const std::string& name : cases) std::erase(found_.left, name);
    to.insert(to.end(), cases.begin(), cases.end());
  }

  void approve_cases(const std::vector<std::string>& cases, const std::string& reason, bool as_alternates) {
    expect_left(cases);
    ApproveOptions options;
    options.suite = options_.suite;
    options.output = options_.output;
    options.cases = cases;
    options.reason = reason;
    options.as_alternates = as_alternates;
    approve(options);
    take(cases, found_.approved);
  }

  void reject_cases(const std::vector<std::string>& cases, const std::string& reason) {
    expect_left(cases);
    for (const std::string& name : cases) rejected_.push_back({{"case", name}, {"reason", reason}});
    write_file(options_.output / "rejected.json", rejected_.dump(1) + "\n");
    take(cases, found_.rejected);
  }

  const ReviewOptions& options_;
  std::string host_;
  std::string word_;
  Json rejected_ = Json::array();
  Review found_;
  bool is_done_ = false;
};

/// Listens on the loopback address; sets `port` to the one that it got.
int listener(int& port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t length = sizeof address;
  auto* const plain = reinterpret_cast<sockaddr*>(&address);
  if (descriptor < 0 || ::bind(descriptor, plain, length) != 0 || ::listen(descriptor, 16) != 0 ||
      ::getsockname(descriptor, plain, &length) != 0) {
    const std::string why = std::strerror(errno);
    if (descriptor >= 0) ::close(descriptor);
    throw Error(fmt::format("port {} of 127.0.0.1 cannot be listened to: {}", port, why));
  }
  port = ntohs(address.sin_port);
  return descriptor;
}

}  // namespace

Review review(const ReviewOptions& options, const std::function<void(const std::string& address)>& ready) {
  int port = options.port;
  const Descriptor door(listener(port));
  Reviewer reviewer(options, port);
  if (reviewer.is_done()) return reviewer.found();
  ready(reviewer.address());
  while (!reviewer.is_done()) {
    const Descriptor connection(::accept4(door.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (connection.get() < 0) continue;
    const timeval limit{seconds_to_wait, 0};
    ::setsockopt(connection.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(connection.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    try {
      send_all(connection.get(), reviewer.answer(request_in(received(connection.get()))));
    } catch (const Error& error) {
      send_all(connection.get(), http_answer(400, "application/json", Json{{"error", error.what()}}.dump()));
    }
  }
  return reviewer.found();
}

}  // namespace substep
