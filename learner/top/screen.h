#pragma once

#include <optional>
#include <vector>

#include "learner/top/group_view.h"

namespace treeroll::top {

/// What a key asks for.
enum class Key { kQuit, kUp, kDown, kPageUp, kPageDown, kNextLearner, kNextOrder };

/// The terminal as a screen, as long as this lives (ncurses, which no header names). One at a time.
class Screen {
 public:
  /// Throws ConfigError where there is no terminal that can be one.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  std::size_t width() const;
  std::size_t height() const;
  void show(const std::vector<Line>& lines);
  /// The terminal has another size.
  void fit();
  /// Nobody is there any more who could press a key.
  bool is_gone() const;
  /// A key that was pressed and means something; nothing if none waits.
  std::optional<Key> read_key();
};

}  // namespace treeroll::top
