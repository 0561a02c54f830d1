#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/files/scratch_folder.h"

namespace treeroll::end_to_end {

/// A headless Chromium, driven over its debugging pipe: Chrome's DevTools protocol, JSON texts that
/// end with a zero byte. Ended (SIGKILL, with all its processes) with this object.
class Browser {
 public:
  /// The executable; empty where there is none.
  static std::filesystem::path program();

  Browser();
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& url);
  void reload();
  void resize(int width, int height);
  /// What an expression comes to; a promise is waited for. Throws std::runtime_error with what went
  /// wrong in the page.
  nlohmann::json evaluate(const std::string& expression);
  /// Waits, at most `limit`, until the expression is true and throws nothing.
  bool eventually(std::chrono::seconds limit, const std::string& expression);
  /// What the console has said of errors so far: exceptions, errors, what could not be loaded.
  std::vector<std::string> take_errors();

 private:
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters = {});
  nlohmann::json next_message();
  void note(const nlohmann::json& event);

  ScratchFolder profile_;
  pid_t pid_ = -1;
  int to_ = -1;
  int from_ = -1;
  std::string input_;
  int last_id_ = 0;
  std::string session_;
  std::vector<std::string> errors_;
};

}  // namespace treeroll::end_to_end
