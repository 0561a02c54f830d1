#include "learner/core/hearing.h"

#include <algorithm>

#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

/// At 30 % loss each way so many mishaps in a row are one in two hundred roll-outs where one is out
/// at a time, and then one greeting puts it right.
constexpr int kLostOfDoubt = 5;
constexpr int kGreetingsOfDeafness = 5;
constexpr int kDoublingsMax = 5;

Duration pause(int times) {
  return protocol::kGreetingPause * (1 << std::min(times - 1, kDoublingsMax));
}

}  // namespace

int Hearing::share_of(int window) const {
  if (!hears_) return 0;
  if (num_lost_ < kLostOfSecondChoice) return window;
  if (num_lost_ >= kLostOfDoubt) return 1;
  return std::max(1, window >> num_lost_);
}

bool Hearing::greeting_due(TimePoint now) const {
  if (hears_) return false;
  // Who is doubted again and again is tried ever more seldom, also if it hears each greeting.
  if (num_greetings_ == 0) return num_doubts_ == 0 || now >= last_lost_at_ + pause(num_doubts_);
  return now >= last_greeted_at_ + pause(num_greetings_);
}

void Hearing::note_word(TimePoint now, std::int64_t batch) {
  if (!greeting_due(now)) return;
  if (num_greetings_++ == 0) {
    first_greeted_at_ = now;
    greeted_in_ = batch;  // an echo of any greeting of the spell will do
  }
  last_greeted_at_ = now;
}

bool Hearing::note_echo(std::int64_t last_batch) {
  if (hears_ || num_greetings_ == 0 || last_batch < greeted_in_) return false;
  hears_ = true;
  return true;
}

bool Hearing::note_lost(TimePoint now, TimePoint issued_at) {
  if (!hears_ || (num_lost_ > 0 && issued_at < last_lost_at_)) return false;
  last_lost_at_ = now;
  num_lost_ = std::min(num_lost_ + 1, kLostOfDoubt);
  if (num_lost_ < kLostOfDoubt) return false;
  hears_ = false;
  ++num_doubts_;
  num_greetings_ = 0;
  return true;
}

void Hearing::note_confirmed() {
  hears_ = true;
  num_lost_ = 0;
  num_doubts_ = 0;
  told_ = false;
}

bool Hearing::seems_deaf(TimePoint now) const {
  return !hears_ && num_greetings_ >= kGreetingsOfDeafness &&
         now >= first_greeted_at_ + protocol::kDeafnessTold;
}

bool Hearing::deafness_to_tell(TimePoint now) {
  if (told_ || !seems_deaf(now)) return false;
  told_ = true;
  return true;
}

}  // namespace treeroll::learner
