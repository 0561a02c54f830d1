#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace treeroll::end_to_end {

/// Hosts on one Ethernet segment: a network namespace each, joined by a bridge in one more.
///
///   host 0          host 1
///     eth0            eth0        10.77.0.1, 10.77.0.2, ...; a multicast route each
///      |               |
///     port0 - bridge - port1
///
/// The namespaces have no names: this process alone holds them, by open descriptors, so they end
/// with it however it ends. It has left the machine's network and mounts itself, for good.
class Network {
 public:
  /// Why there can be no such network here, for a person; nothing where there can. Decided by one
  /// probe, at the first call: whatever fails later is a failure.
  static std::optional<std::string> refusal();

  /// Precondition: no refusal(). Throws std::runtime_error with what `ip` says.
  explicit Network(int num_hosts);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  /// The namespace of a host, for Daemon.
  int host(int index) const { return hosts_.at(static_cast<std::size_t>(index)); }
  /// Of LCM, across hosts.
  static std::string url() { return "udpm://239.255.76.67:7667?ttl=1"; }

  /// From now on each host loses this share of the packets that reach it, drawn one by one: of what
  /// two hosts send each other that share is lost each way. A host's own multicast does not leave
  /// it.
  void lose(int percent);
  /// Packets lost since the last call of lose().
  std::int64_t num_lost() const;

  /// From now on no host takes an IP fragment, as many firewalls and wireless bridges.
  void drop_fragments() const;
  /// Fragments dropped since then.
  std::int64_t num_fragments() const;
  /// Sends one datagram of so many bytes from host 0 to host 1.
  void send_datagram(int num_bytes) const;
  /// From now on the host hears nothing but itself; it is heard as before.
  void deafen(int index) const;

  /// Takes a host's cable out, and puts it in again.
  void cut(int index) const;
  void heal(int index) const;

 private:
  std::int64_t sum_of_counters(const std::string& table) const;

  int bridge_ = -1;
  std::vector<int> hosts_;
};

/// A file system of its own at a folder, seen by this process and those it starts, gone with this
/// object.
class SmallDisk {
 public:
  /// Precondition: no Network::refusal(). Throws std::runtime_error.
  SmallDisk(std::string folder, int size_kib);
  ~SmallDisk();
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  void resize(int size_kib) const;

 private:
  std::string folder_;
};

}  // namespace treeroll::end_to_end
