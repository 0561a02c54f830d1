#include "common/transport/lcm_url.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "common/transport/bus.h"

namespace treeroll::transport {
namespace {

constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

using Options = std::map<std::string, std::string, std::less<>>;

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value >= 0 &&
         value <= std::numeric_limits<double>::max();
}

/// Reads the parts of one URL; every failure names it whole.
class Reader {
 public:
  explicit Reader(const std::string& url) : url_(url) {}

  Result<LcmUrl> read() {
    LcmUrl result;
    result.text = url_;
    const std::size_t colon = url_.find("://");
    if (colon == std::string::npos) return refuse("has no \"://\" after the provider");
    const std::string provider = url_.substr(0, colon);
    std::string network = url_.substr(colon + 3);
    Options options;
    if (const std::size_t mark = network.find('?'); mark != std::string::npos) {
      if (auto error = read_options(network.substr(mark + 1), options)) return *error;
      network.resize(mark);
    }
    std::optional<Error> error;
    if (provider == "udpm") {
      error = read_udpm(network, options, result);
    } else if (provider == "tcpq") {
      error = read_tcpq(network, options, result);
    } else if (provider == "memq") {
      error = read_memq(network, options, result);
    } else if (provider == "file") {
      error = read_file(network, options, result);
    } else {
      error = refuse("provider \"{}\" must be udpm, tcpq, memq or file", provider);
    }
    if (error) return *error;
    return result;
  }

 private:
  template <class... Arguments>
  Error refuse(fmt::format_string<const Arguments&...> rule, const Arguments&... arguments) const {
    return Error{fmt::format("LCM URL \"{}\": {}", url_, fmt::format(rule, arguments...))};
  }

  std::optional<Error> read_options(std::string_view text, Options& options) const {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find_first_of("&,"), text.size());
      const std::string_view option = text.substr(0, end);
      const std::size_t equals = option.find('=');
      if (equals == std::string_view::npos || equals == 0) {
        return refuse("option \"{}\" must read name=value", option);
      }
      const bool is_new =
          options.emplace(option.substr(0, equals), option.substr(equals + 1)).second;
      if (!is_new) return refuse("option \"{}\" stands twice", option.substr(0, equals));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    return std::nullopt;
  }

  std::optional<Error> allow(const Options& options, const std::set<std::string>& known) const {
    for (const auto& [name, value] : options) {
      if (!known.contains(name)) {
        return refuse("unknown option \"{}\"; known here: {}", name,
                      known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")));
      }
    }
    return std::nullopt;
  }

  std::optional<Error> read_integer(const Options& options, const char* name, int min, int max,
                                    int& value) const {
    const auto found = options.find(name);
    if (found == options.end()) return std::nullopt;
    const auto number = whole_number(found->second);
    if (!number || *number < min || *number > max) {
      return refuse("{} \"{}\" must be a whole number within {}..{}", name, found->second, min,
                    max);
    }
    value = static_cast<int>(*number);
    return std::nullopt;
  }

  /// host:port into `result`, which holds the defaults.
  std::optional<Error> read_address(const std::string& network, const char* what,
                                    LcmUrl& result) const {
    const std::size_t colon = network.find(':');
    if (!network.empty()) result.host = network.substr(0, colon);
    in_addr address{};
    if (inet_pton(AF_INET, result.host.c_str(), &address) != 1) {
      return refuse("{} \"{}\" must be an IPv4 address in dotted form", what, result.host);
    }
    if (colon == std::string::npos) return std::nullopt;
    const std::string text = network.substr(colon + 1);
    const auto port = whole_number(text);
    if (!port || *port < 1 || *port > std::numeric_limits<std::uint16_t>::max()) {
      return refuse("port \"{}\" must be a whole number within 1..65535", text);
    }
    result.port = static_cast<std::uint16_t>(*port);
    return std::nullopt;
  }

  std::optional<Error> read_udpm(const std::string& network, const Options& options,
                                 LcmUrl& result) const {
    result.provider = Provider::kUdpm;
    result.host = "239.255.76.67";
    result.port = 7667;
    result.receive_buffer_bytes = kReceiveBufferBytesDefault;
    if (auto error = read_address(network, "group", result)) return error;
    in_addr group{};
    inet_pton(AF_INET, result.host.c_str(), &group);
    if (!IN_MULTICAST(ntohl(group.s_addr))) {
      return refuse("group \"{}\" must be a multicast address, 224.0.0.0 to 239.255.255.255",
                    result.host);
    }
    if (auto error = allow(options, {"recv_buf_size", "ttl"})) return error;
    if (auto error = read_integer(options, "ttl", 0, 255, result.ttl)) return error;
    auto error = read_integer(options, "recv_buf_size", 4096, 1 << 30, result.receive_buffer_bytes);
    if (error) return error;
    result.text = fmt::format("udpm://{}:{}?ttl={}", result.host, result.port, result.ttl);
    if (options.contains("recv_buf_size")) {
      result.text += fmt::format("&recv_buf_size={}", result.receive_buffer_bytes);
    }
    return std::nullopt;
  }

  std::optional<Error> read_tcpq(const std::string& network, const Options& options,
                                 LcmUrl& result) const {
    result.provider = Provider::kTcpq;
    result.host = "127.0.0.1";
    result.port = 7700;
    // liblcm means to look names up and does not: dotted addresses only.
    if (auto error = read_address(network, "server", result)) return error;
    result.text = fmt::format("tcpq://{}:{}", result.host, result.port);
    return allow(options, {});
  }

  std::optional<Error> read_memq(const std::string& network, const Options& options,
                                 LcmUrl& result) const {
    result.provider = Provider::kMemq;
    if (!network.empty()) return refuse("\"{}\" after memq:// must be absent", network);
    return allow(options, {});
  }

  std::optional<Error> read_file(const std::string& network, const Options& options,
                                 LcmUrl& result) const {
    result.provider = Provider::kFile;
    if (network.empty()) return refuse("the path of a log must follow file://");
    if (auto error = allow(options, {"mode", "speed", "start_timestamp"})) return error;
    for (const char* name : {"speed", "start_timestamp"}) {
      const auto option = options.find(name);
      if (option != options.end() && !is_number(option->second)) {
        return refuse("{} \"{}\" must be a number that is not negative", name, option->second);
      }
    }
    const auto mode = options.find("mode");
    if (mode == options.end() || std::set<std::string>{"r", "w", "a"}.contains(mode->second)) {
      return std::nullopt;
    }
    return refuse("mode \"{}\" must be r, w or a", mode->second);
  }

  const std::string& url_;
};

}  // namespace

std::string resolve_url(const std::string& option) {
  if (!option.empty()) return option;
  const char* environment = std::getenv(kUrlVariable);
  if (environment != nullptr && *environment != '\0') return environment;
  return kDefaultUrl;
}

Result<LcmUrl> parse_lcm_url(const std::string& url) { return Reader(url).read(); }

}  // namespace treeroll::transport
