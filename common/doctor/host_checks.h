#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "common/doctor/finding.h"

namespace treeroll::doctor {

/// Where datagrams to a group leave this host.
struct WayOut {
  std::string address;    ///< of this host, dotted IPv4
  std::string interface;  ///< empty: none has that address
  bool is_loopback = false;
};
/// Nothing without a route.
std::optional<WayOut> way_out_to(const std::string& group, std::uint16_t port);
Finding judge_route(const std::optional<WayOut>& way, const std::string& group, int ttl);

/// @param granted, asked  bytes
Finding judge_receive_buffer(std::int64_t granted, std::int64_t asked);

/// Datagrams that UDP sockets on this host have lost so far, since they were full. Not the counters
/// of the sockets in /proc/net/udp: these count what a socket's filter refuses too, as ours do.
/// @param snmp  /proc/net/snmp
std::int64_t lost_in_full_sockets(std::string_view snmp);
Finding judge_drops(std::int64_t before, std::int64_t after, double seconds);

/// Room, permission and how long it takes until what is written lasts. Makes one file there and
/// removes it.
Findings check_folder(const std::filesystem::path& folder);

/// Whether the system's clock follows a time server: logs and journals bear its time, nothing else
/// depends on it.
Finding check_clock();
/// Processors that this process may keep busy.
Finding check_processors();
/// What a report draws its figures with.
Finding check_gnuplot();

}  // namespace treeroll::doctor
