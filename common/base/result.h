#pragma once

#include <string>
#include <utility>
#include <variant>

#include "common/base/check.h"

namespace treeroll {

/// Why something from outside was refused: one line for a person.
struct Error {
  std::string message;
};

/// A value, or why there is none; for data from outside (datagrams, files, sockets).
///
///   Result<Gmm> gmm = read(...);
///   if (!gmm) return gmm.error();
///   use(*gmm);
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const { return std::holds_alternative<T>(state_); }

  /// Precondition of the four below: there is a value.
  T& operator*() & { return value(); }
  const T& operator*() const& { return const_cast<Result*>(this)->value(); }
  T&& operator*() && { return std::move(value()); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &**this; }

  /// Precondition: there is no value.
  const Error& error() const {
    CHECK(!*this, "error() of a result that holds a value");
    return std::get<Error>(state_);
  }

 private:
  T& value() {
    CHECK(*this, std::get<Error>(state_).message);
    return std::get<T>(state_);
  }

  std::variant<T, Error> state_;
};

}  // namespace treeroll
