#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"
#include "tests/transport/message_maker.h"

namespace treeroll::transport {
namespace {

using protocol::Message;
using testing::HasSubstr;
using ByteVector = std::vector<std::byte>;

constexpr std::size_t kFingerprintBytes = 8;
constexpr std::size_t kSignatureBytes = 8 + 8 + 16;

/// The law for bytes from outside: they are refused, or they are exactly what the message they
/// decode to encodes to, but for the signature. Returns whether they were taken.
bool is_taken_faithfully(Channel channel, const ByteVector& bytes) {
  const Result<Message> message = decode(channel, bytes);
  if (!message) {
    EXPECT_FALSE(message.error().message.empty());
    return false;
  }
  ByteVector back = encode(*message);
  EXPECT_EQ(back.size(), bytes.size());
  std::memcpy(back.data() + back.size() - kSignatureBytes,
              bytes.data() + bytes.size() - kSignatureBytes, kSignatureBytes);
  EXPECT_EQ(back, bytes);
  return true;
}

void put(ByteVector& bytes, std::size_t at, std::int64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    bytes.at(at + i) = static_cast<std::byte>(value >> (8 * (size - 1 - i)));
  }
}

ByteVector fingerprint_of(Channel channel) {
  ByteVector bytes = encode(MessageMaker(0).make(channel));
  bytes.resize(kFingerprintBytes);
  return bytes;
}

/// Fields in network order behind a fingerprint: a message written by hand.
class Writer {
 public:
  explicit Writer(Channel channel) : bytes_(fingerprint_of(channel)) {}
  Writer& i64(std::int64_t value) { return integer(value, 8); }
  Writer& i32(std::int32_t value) { return integer(value, 4); }
  Writer& i8(int value) { return integer(value, 1); }
  Writer& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  Writer& text(const std::string& text) {
    i32(static_cast<std::int32_t>(text.size()) + 1);
    for (const char c : text) bytes_.push_back(static_cast<std::byte>(c));
    return zeros(1);
  }
  const ByteVector& bytes() const { return bytes_; }

 private:
  Writer& integer(std::int64_t value, std::size_t size) {
    bytes_.resize(bytes_.size() + size);
    put(bytes_, bytes_.size() - size, value, size);
    return *this;
  }
  ByteVector bytes_;
};

std::string refused(Channel channel, const ByteVector& bytes) {
  const Result<Message> message = decode(channel, bytes);
  return message ? "taken" : message.error().message;
}

TEST(CodecHostileTest, EveryTruncationOfEveryMessageIsRefused) {
  for (const Channel channel : kAllChannels) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const ByteVector whole = encode(MessageMaker(seed).make(channel));
      for (std::size_t size = 0; size < whole.size(); ++size) {
        // A copy of just this size, so that a read past it is seen by the sanitizer.
        const ByteVector part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
        ASSERT_FALSE(is_taken_faithfully(channel, part)) << "seed " << seed << ", " << size;
      }
    }
  }
}

TEST(CodecHostileTest, BytesThatFollowAreRefused) {
  for (const Channel channel : kAllChannels) {
    ByteVector bytes = encode(MessageMaker(5).make(channel));
    bytes.push_back(std::byte{0});
    EXPECT_THAT(refused(channel, bytes), HasSubstr("1 bytes follow the last field"));
  }
}

TEST(CodecHostileTest, EveryWordOfEveryMessageMayBeMutated) {
  for (const Channel channel : kAllChannels) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const ByteVector whole = encode(MessageMaker(seed).make(channel));
      for (std::size_t at = 0; at + 4 <= whole.size(); ++at) {
        for (const std::int64_t value :
             {-1LL, 0LL, 1LL, 0x7fffffffLL, 0x80000000LL, 0x7ff00000LL}) {
          ByteVector bytes = whole;
          put(bytes, at, value, 4);
          is_taken_faithfully(channel, bytes);
          if (HasFailure()) FAIL() << channel_name(channel) << ", seed " << seed << ", at " << at;
        }
      }
    }
  }
}

TEST(CodecHostileTest, RandomBytesAreRefusedOrAShortMessage) {
  std::mt19937_64 random(1);
  int num_taken = 0;
  for (int i = 0; i < 100000; ++i) {
    const Channel channel = kAllChannels[random() % kAllChannels.size()];
    // Half of them behind a true fingerprint, so that the fields are reached.
    ByteVector bytes = random() % 2 == 0 ? fingerprint_of(channel) : ByteVector{};
    for (std::size_t size = random() % 300; size > 0; --size) {
      // Zeros and small numbers go further than noise does.
      bytes.push_back(random() % 2 == 0 ? std::byte{0} : static_cast<std::byte>(random() % 256));
    }
    num_taken += is_taken_faithfully(channel, bytes) ? 1 : 0;
    ASSERT_FALSE(HasFailure()) << "datagram " << i;
  }
  EXPECT_LE(num_taken, 10) << "a request for nothing is short";
}

TEST(CodecHostileTest, AThirtySixByteMessageThatClaimsTwoBillionRolloutsIsRefused) {
  const ByteVector bytes =
      Writer(Channel::kRolloutBatch).i64(1).i64(1).i32(0x7fffffff).i64(0).bytes();
  ASSERT_EQ(bytes.size(), 36U);
  EXPECT_EQ(refused(Channel::kRolloutBatch, bytes),
            "rollout_batch.rollouts: count 2147483647 is not within 0..1024");
}

TEST(CodecHostileTest, ACountWithinItsLimitButPastTheMessageIsRefused) {
  const ByteVector bytes = Writer(Channel::kRolloutBatch).i64(1).i64(1).i32(1024).i64(0).bytes();
  EXPECT_EQ(refused(Channel::kRolloutBatch, bytes),
            "rollout_batch.rollouts[0].key.run: needs 4 bytes and 0 are left");
}

TEST(CodecHostileTest, ReasonsNameTheFieldTheValueAndTheRule) {
  protocol::RolloutBatch batch;
  batch.rollouts.assign(4, {});
  ByteVector bytes = encode(batch);
  // Three roll-outs of 76 bytes without theta, then the fourth's up to its count.
  const std::size_t fourth = kFingerprintBytes + 8 + 8 + 4 + 3 * 76 + 68;
  put(bytes, fourth, -1, 4);
  EXPECT_EQ(refused(Channel::kRolloutBatch, bytes),
            "rollout_batch.rollouts[3].theta: count -1 is not within 0..4096");
}

struct HostileList {
  const char* description;
  Channel channel;
  ByteVector up_to_count;
  int count_max;
};

TEST(CodecHostileTest, EveryCountIsHeldToItsLimit) {
  using protocol::kHeldPerMessageMax;
  Writer status(Channel::kWorkerStatus);
  status.i64(1).text("h").i32(1).text("v").text("n").i32(1).i32(1).i32(1).i8(0).zeros(40);
  Writer nested = status;
  nested.i32(1).i64(1).i64(1).i64(1);
  Writer request(Channel::kRolloutBatch);
  request.i64(1).i64(1).i32(1).zeros(68);
  Writer wanted(Channel::kDefinitionRequest);
  wanted.i64(1).i64(1).i32(1).i8(2).zeros(16);
  const std::vector<HostileList> lists = {
      {"rollout_batch.rollouts", Channel::kRolloutBatch,
       Writer(Channel::kRolloutBatch).i64(1).i64(1).bytes(), protocol::kRolloutsPerBatchMax},
      {"rollout_batch.rollouts[0].theta", Channel::kRolloutBatch, request.bytes(),
       protocol::kThetaDimMax},
      {"rollout_batch.rollouts[0].theta_ids", Channel::kRolloutBatch,
       Writer(request).i32(0).bytes(), 1},
      {"rollout_batch.acknowledgements", Channel::kRolloutBatch,
       Writer(Channel::kRolloutBatch).i64(1).i64(1).i32(0).bytes(),
       protocol::kAcknowledgementsPerBatchMax},
      {"rollout_batch.word_macs", Channel::kRolloutBatch,
       Writer(Channel::kRolloutBatch).i64(1).i64(1).i32(0).i32(0).bytes(),
       protocol::kNamedPerBatchMax},
      {"reward_batch.results", Channel::kRewardBatch,
       Writer(Channel::kRewardBatch).i64(1).i64(1).i64(1).i64(1).i32(1).i64(1).i64(1).bytes(),
       protocol::kResultsPerBatchMax},
      {"worker_status.held", Channel::kWorkerStatus, status.bytes(),
       protocol::kLearnersPerStatusMax},
      {"worker_status.held[0].keys", Channel::kWorkerStatus, nested.bytes(), kHeldPerMessageMax},
      {"definition_request.definitions", Channel::kDefinitionRequest,
       Writer(Channel::kDefinitionRequest).i64(1).i64(1).bytes(),
       protocol::kDefinitionsPerRequestMax},
      {"definition_request.definitions[0].pieces", Channel::kDefinitionRequest, wanted.bytes(),
       protocol::kPiecesMax},
      {"definition_piece.piece", Channel::kDefinitionPiece,
       Writer(Channel::kDefinitionPiece).i64(1).i8(1).zeros(16).i32(1).i32(0).bytes(),
       static_cast<int>(protocol::kPieceBytes)},
  };
  for (const HostileList& list : lists) {
    for (const int count : {-1, std::numeric_limits<int>::min(), list.count_max + 1,
                            std::numeric_limits<int>::max()}) {
      ByteVector bytes = list.up_to_count;
      bytes.resize(bytes.size() + 4 + 60000);
      put(bytes, list.up_to_count.size(), count, 4);
      EXPECT_EQ(refused(list.channel, bytes), std::string(list.description) + ": count " +
                                                  std::to_string(count) + " is not within 0.." +
                                                  std::to_string(list.count_max));
    }
  }
}

TEST(CodecHostileTest, BadStringsAreRefused) {
  const auto definition = [](std::int32_t length, const std::string& text) {
    Writer writer(Channel::kDefinitionReport);
    writer.i64(1).i64(1).zeros(16).i8(1).i32(length);
    ByteVector bytes = writer.bytes();
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    bytes.resize(bytes.size() + kSignatureBytes);
    return refused(Channel::kDefinitionReport, bytes);
  };
  using namespace std::string_literals;
  const std::string field = "definition_report.text: ";
  EXPECT_EQ(definition(4, "abc\0"s), "taken");
  EXPECT_EQ(definition(1, "\0"s), "taken");
  EXPECT_EQ(definition(0, ""), field + "length with its NUL 0 is not within 1..1025");
  EXPECT_EQ(definition(-5, ""), field + "length with its NUL -5 is not within 1..1025");
  EXPECT_EQ(definition(1026, ""), field + "length with its NUL 1026 is not within 1..1025");
  EXPECT_EQ(definition(100, "abc\0"s), field + "needs 100 bytes and 36 are left");
  EXPECT_EQ(definition(3, "abc"), field + "does not end with a NUL");
  EXPECT_EQ(definition(4, "a\0c\0"s), field + "has a NUL within");
  for (const char* text : {"\x80", "\xc0\x80", "\xe2\x82", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                           "\xff", "a\xc3", "\xe0\x80\x80", "\xf0\x80\x80\x80"}) {
    const std::string bad(text);
    EXPECT_EQ(definition(static_cast<std::int32_t>(bad.size()) + 1, bad + '\0'),
              field + "is not UTF-8");
  }
}

/// One broken value each, encoded as a careless or hostile peer would.
TEST(CodecHostileTest, BadValuesAreRefusedByName) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  protocol::RewardBatch reward;
  reward.results.assign(2, {});
  reward.results[1].outcome = Outcome::ok(kNan);
  protocol::RewardBatch infinite = reward;
  infinite.results[1].outcome = Outcome::ok(-kInfinity);
  protocol::RewardBatch status = reward;
  status.results[1] = {};
  status.results[1].outcome = {0, static_cast<RolloutStatus>(6)};
  protocol::RewardBatch negative_status = status;
  negative_status.results[1].outcome = {0, static_cast<RolloutStatus>(-1)};
  protocol::RewardBatch duration = status;
  duration.results[1] = {};
  duration.results[1].duration_ns = -3;
  protocol::RewardBatch too_long = status;
  too_long.results[1] = {};
  too_long.results[1].duration_ns = protocol::kDurationNsMax + 1;
  protocol::RolloutBatch sequence;
  sequence.sequence = protocol::kRunningNumberMax + 1;
  protocol::WorkerStatus evaluators;
  evaluators.num_evaluators = protocol::kEvaluatorsPerWorkerMax + 1;
  protocol::RewardBatch run = status;
  run.results[1] = {};
  run.results[1].key.run = -1;
  protocol::RolloutBatch theta;
  theta.rollouts.assign(1, {});
  theta.rollouts[0].theta = {0, 1, kInfinity};
  protocol::RolloutBatch learner;
  learner.learner_id = -7;
  protocol::WorkerStatus slots;
  slots.free_slots = -1;
  protocol::RunStatus slope;
  slope.reward_slope = kNan;
  protocol::LearnerStatus name;
  name.study.assign(protocol::kNameBytesMax + 1, 'x');
  protocol::DefinitionPiece kind;
  kind.name.kind = static_cast<protocol::DefinitionKind>(3);
  protocol::DefinitionPiece whole;
  whole.num_bytes = static_cast<int>(protocol::kDefinitionBytesMax) + 1;
  protocol::DefinitionRequest number;
  number.definitions = {{{}, {0, protocol::kPiecesMax}}};

  const std::vector<std::pair<Message, std::string>> table = {
      {reward, "reward_batch.results[1].reward: nan is not a finite number"},
      {infinite, "reward_batch.results[1].reward: -inf is not a finite number"},
      {status, "reward_batch.results[1].status: 6 is not within 0..5"},
      {negative_status, "reward_batch.results[1].status: -1 is not within 0..5"},
      {duration, "reward_batch.results[1].duration_ns: -3 is not within 0..8640000000000000"},
      {too_long,
       "reward_batch.results[1].duration_ns: 8640000000000001 is not within 0..8640000000000000"},
      {sequence,
       "rollout_batch.sequence: 4611686018427387905 is not within 0..4611686018427387904"},
      {kind, "definition_piece.kind: 3 is not within 0..2"},
      {whole, "definition_piece.total_bytes: 1048577 is not within 0..1048576"},
      {number, "definition_request.definitions[0].pieces[1]: 1024 is not within 0..1023"},
      {evaluators, "worker_status.num_evaluators: 1025 is not within 0..1024"},
      {run, "reward_batch.results[1].key.run: -1 is negative"},
      {theta, "rollout_batch.rollouts[0].theta[2]: inf is not a finite number"},
      {learner, "rollout_batch.learner_id: -7 is negative"},
      {slots, "worker_status.free_slots: -1 is not within 0..4096"},
      {slope, "run_status.reward_slope: nan is not a finite number"},
      {name, "learner_status.study: length with its NUL 130 is not within 1..129"},
  };
  for (const auto& [message, reason] : table) {
    EXPECT_EQ(refused(channel_of(message), encode(message)), reason);
  }
}

TEST(CodecHostileTest, ABooleanIsNoughtOrOne) {
  ByteVector bytes = encode(protocol::RunStatus{});
  bytes[bytes.size() - kSignatureBytes - 1] = std::byte{2};
  EXPECT_EQ(refused(Channel::kRunStatus, bytes), "run_status.done: 2 is not within 0..1");
}

TEST(CodecHostileTest, AMessageOfAnotherVersionIsRefusedAsSuch) {
  ByteVector bytes = encode(protocol::RunStatus{});
  bytes[0] ^= std::byte{1};
  EXPECT_THAT(refused(Channel::kRunStatus, bytes),
              testing::AllOf(HasSubstr("run_status.fingerprint"), HasSubstr("another version")));
}

TEST(CodecHostileTest, AMessagePastTheSizeLimitIsRefused) {
  protocol::RewardBatch batch;
  protocol::RolloutResult result;
  result.outcome = Outcome::failed(RolloutStatus::kFailed, std::string(40, 'x'));
  batch.results.assign(1024, result);
  EXPECT_THAT(refused(Channel::kRewardBatch, encode(batch)),
              HasSubstr("bytes are more than 65000"));
}

}  // namespace
}  // namespace treeroll::transport
