#pragma once

#include <vector>

#include "tests/simulation/dice.h"
#include "tests/simulation/gate.h"
#include "tests/simulation/node.h"
#include "tests/simulation/scenario.h"

namespace treeroll::simulation {

/// Somebody on the network who hears everything and says what he likes: plays back, alters, makes
/// things up; with no key, with a key of his own, or with that of a worker of the cluster.
class Stranger {
 public:
  Stranger(std::uint64_t seed, bool has_keys);

  /// What he says to who gets this message.
  Node::MessagePointer answer(const Node::MessagePointer& heard);

 private:
  protocol::Message altered(const protocol::Message& heard);
  /// What the holder of a worker's key can sign of a learner's: announcements, and words of zeros.
  Node::MessagePointer as_a_learner(const protocol::RolloutBatch& heard);
  Node::MessagePointer flipped(const Datagram& heard);

  Dice dice_;
  bool has_keys_;
  Gate insider_;
  Gate announcer_;
  std::vector<Node::MessagePointer> recording_;
};

}  // namespace treeroll::simulation
