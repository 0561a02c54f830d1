#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/protocol/wire_sizes.h"
#include "common/transport/wire_fields.h"

namespace treeroll::transport::wire {

/// Visitor of wire_fields.h that walks the bytes of a message and applies each field's rule.
/// lcm-gen's decode trusts every count; this makes sure beforehand that it may. Every element of a
/// list takes bytes, so the work is bounded by the length of the message, and nothing is allocated
/// unless something is refused. After the first refusal the rest is not looked at.
class Checker {
 public:
  /// @param type   name for the reasons: "rollout_batch"
  /// @param bytes  must outlive the checker
  Checker(const char* type, std::span<const std::byte> bytes) : type_(type), bytes_(bytes) {}

  /// The first eight bytes, which name the layout.
  void fingerprint(std::int64_t expected);
  /// Nothing may follow the last field.
  void end();
  /// Why the message is refused: the field's path, what is there, the rule. Empty: it is not.
  const std::optional<std::string>& refusal() const { return refusal_; }

  template <class M, class W>
  void count(const char* name, M&, W&) {
    const Step step(*this, name);
    if (const auto value = integer_of(sizeof(W)); value && *value < 0) {
      refuse(std::to_string(*value) + " is negative");
    }
  }
  template <class M, class W>
  void bounded(const char* name, M&, W&, std::int64_t max) {
    const Step step(*this, name);
    if (const auto value = integer_of(sizeof(W)); value && (*value < 0 || *value > max)) {
      refuse(std::to_string(*value) + " is not within 0.." + std::to_string(max));
    }
  }
  template <class M, class W>
  void integer(const char* name, M&, W&) {
    const Step step(*this, name);
    integer_of(sizeof(W));
  }
  template <class M, class W>
  void number(const char* name, M&, W&) {
    const Step step(*this, name);
    finite_number();
  }
  template <class M, class W>
  void flag(const char* name, M&, W&) {
    const Step step(*this, name);
    integer_within(1, 0, 1, "");
  }
  template <class M, class R, class S, class T>
  void outcome(M&, R&, S&, T&, std::size_t reason_bytes_max) {
    outcome(reason_bytes_max);
  }
  template <class M, class W>
  void kind(const char* name, M&, W&) {
    const Step step(*this, name);
    integer_within(1, 0, protocol::kNumDefinitionKinds - 1, "");
  }
  template <class M, class W>
  void hash(const char* name, M&, W&) {
    const Step step(*this, name);
    take(sizeof(ContentHash::bytes));
  }
  template <class M, class W>
  void text(const char* name, M&, W&, std::size_t bytes_max) {
    const Step step(*this, name);
    string(bytes_max);
  }
  template <class M, class W>
  void record(const char* name, M& m, W& w) {
    const Step step(*this, name);
    Fields<std::remove_const_t<M>>::visit(*this, m, w);
  }
  template <class M, class C, class W>
  void records(const char* name, M&, C&, W&, int count_max) {
    typename M::value_type m;
    typename W::value_type w;
    list(name, count_max, [&] { Fields<typename M::value_type>::visit(*this, m, w); });
  }
  template <class M, class C, class W>
  void numbers(const char* name, M&, C&, W&, int count_max) {
    list(name, count_max, [&] { finite_number(); });
  }
  template <class M, class C, class W>
  void integers(const char* name, M&, C&, W&, int count_max, int max) {
    list(name, count_max, [&] { integer_within(4, 0, max, ""); });
  }
  template <class M, class C, class W>
  void maybe_hash(const char* name, M&, C&, W&) {
    list(name, 1, [&] { take(sizeof(ContentHash::bytes)); });
  }
  template <class M, class C, class W>
  void bytes(const char* name, M&, C&, W&, std::size_t bytes_max) {
    const Step step(*this, name);
    const auto size = integer_within(4, 0, static_cast<std::int64_t>(bytes_max), "count ");
    if (size) take(static_cast<std::size_t>(*size));
  }
  template <class C, class W>
  void word_macs(const char* name, C&, W&, int count_max) {
    list(name, count_max, [&] { take(protocol::kMacBytes); });
  }
  template <class K, class I, class W>
  void signature(K& key_id, I& signed_index, W& mac) {
    count("key_id", key_id, key_id);
    count("signed_index", signed_index, signed_index);
    const Step step(*this, "mac");
    take(sizeof(mac));
  }

 private:
  /// Where the walk is: a field's name and, within a list, an index.
  struct Place {
    const char* name;
    int index = -1;
  };
  class Step {
   public:
    Step(Checker& checker, const char* name) : checker_(checker) {
      checker_.path_.at(checker_.depth_++) = {name};
    }
    ~Step() { --checker_.depth_; }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

   private:
    Checker& checker_;
  };

  template <class Visit>
  void list(const char* name, int count_max, Visit visit) {
    const Step step(*this, name);
    const auto size = integer_within(4, 0, count_max, "count ");
    for (int i = 0; size && i < *size && !refusal_; ++i) {
      path_[depth_ - 1].index = i;
      visit();
    }
  }

  /// The next `size` bytes, or a null pointer and a refusal.
  const std::byte* take(std::size_t size);
  /// A big-endian two's-complement integer.
  std::optional<std::int64_t> integer_of(std::size_t size);
  std::optional<std::int64_t> integer_within(std::size_t size, std::int64_t min, std::int64_t max,
                                             const char* what);
  /// The number, a refused one too.
  std::optional<double> finite_number();
  /// Length of the text, without its NUL.
  std::size_t string(std::size_t bytes_max);
  void outcome(std::size_t reason_bytes_max);
  void refuse(const std::string& reason);

  const char* type_;
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::array<Place, 4> path_{};
  std::size_t depth_ = 0;
  std::optional<std::string> refusal_;
};

}  // namespace treeroll::transport::wire
