#include "learner/top/screen.h"

#include <ncurses.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>

#include "common/base/config_error.h"

namespace treeroll::top {
namespace {

// Pairs of colours by number.
constexpr short kGreen = 1;
constexpr short kYellow = 2;
constexpr short kRed = 3;
constexpr short kBlue = 4;

attr_t attributes_of(Look look) {
  switch (look) {
    case Look::kPlain:
      return A_NORMAL;
    case Look::kQuiet:
      return A_UNDERLINE;
    case Look::kHead:
      return A_BOLD;
    case Look::kGood:
      return COLOR_PAIR(kGreen);
    case Look::kWarning:
      return COLOR_PAIR(kYellow) | A_BOLD;
    case Look::kBad:
      return COLOR_PAIR(kRed) | A_BOLD;
    case Look::kBar:
      return COLOR_PAIR(kBlue);
  }
  return A_NORMAL;
}

}  // namespace

Screen::Screen() {
  const char* name = std::getenv("TERM");
  // newterm() instead of initscr(), which ends the process where it knows no such terminal.
  if (isatty(STDOUT_FILENO) != 1 || isatty(STDIN_FILENO) != 1 ||
      newterm(nullptr, stdout, stdin) == nullptr) {
    throw ConfigError("TERM", name == nullptr ? "" : name,
                      "standard input and output must be a terminal; --once prints what is heard");
  }
  cbreak();
  noecho();
  nodelay(stdscr, TRUE);
  keypad(stdscr, TRUE);
  curs_set(0);
  if (has_colors()) {
    start_color();
    use_default_colors();
    init_pair(kGreen, COLOR_GREEN, -1);
    init_pair(kYellow, COLOR_YELLOW, -1);
    init_pair(kRed, COLOR_RED, -1);
    init_pair(kBlue, COLOR_BLUE, -1);
  }
}

Screen::~Screen() { endwin(); }

std::size_t Screen::width() const { return static_cast<std::size_t>(getmaxx(stdscr)); }

std::size_t Screen::height() const { return static_cast<std::size_t>(getmaxy(stdscr)); }

void Screen::show(const std::vector<Line>& lines) {
  erase();
  for (std::size_t row = 0; row < lines.size(); ++row) {
    move(static_cast<int>(row), 0);
    for (const Span& span : lines[row]) {
      attrset(static_cast<int>(attributes_of(span.look)));
      addnstr(span.text.c_str(), static_cast<int>(span.text.size()));
    }
  }
  refresh();
}

void Screen::fit() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 && size.ws_col > 0) {
    resizeterm(size.ws_row, size.ws_col);
  }
}

bool Screen::is_gone() const {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  int num_waiting = 0;
  return poll(&input, 1, 0) > 0 &&
         (ioctl(STDIN_FILENO, FIONREAD, &num_waiting) != 0 || num_waiting == 0);
}

std::optional<Key> Screen::read_key() {
  for (int key = getch(); key != ERR; key = getch()) {
    switch (key) {
      case 'q':
        return Key::kQuit;
      case KEY_UP:
      case 'k':
        return Key::kUp;
      case KEY_DOWN:
      case 'j':
        return Key::kDown;
      case KEY_PPAGE:
        return Key::kPageUp;
      case KEY_NPAGE:
      case ' ':
        return Key::kPageDown;
      case '\t':
        return Key::kNextLearner;
      case 'o':
        return Key::kNextOrder;
      default:
        break;
    }
  }
  return std::nullopt;
}

}  // namespace treeroll::top
