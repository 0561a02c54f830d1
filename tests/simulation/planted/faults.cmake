# The planted faults: name, file, what stands there once, what stands there in the copy. PLANTED is
# true while the fault of that name is at work, MEMORY an integer that is 0 before the first seed.
# A fault may take several places.

plant("deduplication off" learner/core/workforce_answers.cc
  [[if (!open) return compare_with_taken(]]
  [[if (!open && PLANTED && client_.answer_of(key)) {
    turn.effects.emplace_back(AppendResult{
        {key, result.content, result.outcome, worker.id}});
  }
  if (!open) return compare_with_taken(]])
plant("deduplication off" learner/core/workforce_answers.cc
  [[if (worker->results_read.contains(index) &&]]
  [[if (!PLANTED && worker->results_read.contains(index) &&]])

plant("lease never expires" learner/core/dispatch.cc
  [[if (!worker.answer_time_s || rollout_time_s]]
  [[if (PLANTED) return kLeaseMax;
  if (!worker.answer_time_s || rollout_time_s]])

plant("expiry fails the roll-out" learner/core/workforce.cc
  [[for (const Ledger::Expired& expired : ledger_.expire(turn.now)) {]]
  [[for (const Ledger::Expired& expired : ledger_.expire(turn.now)) {
    if (PLANTED) {
      const Ledger::Entry entry = ledger_.close(expired.key);
      const AcceptedResult failed{expired.key, entry.question.content,
                                  Outcome::failed(RolloutStatus::kTimedOut), entry.last_worker};
      turn.effects.emplace_back(AppendResult{failed});
      client_.take(turn, failed, 0);
      continue;
    }]])

plant("send before journal" learner/core/carry_out.cc
  [[void carry_out(const Effects& effects, EffectHandler& handler) {]]
  [[void carry_out(const Effects& effects, EffectHandler& handler) {
  for (const Effect& effect : effects) {
    const auto* send = std::get_if<SendMessage>(&effect);
    if (PLANTED && send) handler.send(send->message);
  }]])
plant("send before journal" learner/core/carry_out.cc
  [[if (send) handler]]
  [[if (send && !PLANTED) handler]])

plant("apply before journal" learner/core/carry_out.cc
  [[if (send && !std::exchange]]
  [[if (send && !PLANTED && !std::exchange]])

plant("acknowledge before fdatasync" learner/core/workforce_answers.cc
  [[if (num_unsynced_ == 0)]]
  [[if (PLANTED || num_unsynced_ == 0)]])

plant("accepted during fdatasync taken for synced" learner/core/workforce.cc
  [[std::max(worker->last_index_settled, worker->last_index_syncing)]]
  [[PLANTED ? worker->results_read.last_without_gap()
                                           : std::max(worker->last_index_settled, worker->last_index_syncing)]])

plant("a left layer's result learnt from" learner/explore/exploration.cc
  [[if (draw.layer == layer() && !stopped_)]]
  [[if ((draw.layer == layer() || (PLANTED && draw.theta.size() == mean().size())) && !stopped_)]])

plant("another incarnation's answer accepted" learner/core/workforce_answers.cc
  [[if (batch.learner_id != settings_.learner_id) return;]]
  [[if (!PLANTED && batch.learner_id != settings_.learner_id) return;]])

plant("the store answers for an older theta" workers/core/answer_store.cc
  [[const std::optional<std::int64_t> index = row.indices.find({key, content});]]
  [[std::optional<std::int64_t> index = row.indices.find({key, content});
  if (PLANTED && !index) {
    const auto older = std::ranges::find_if(
        row.answers, [&](const Answer& a) { return a.is_here && a.result.key == key; });
    if (older != row.answers.end()) {
      protocol::RolloutResult result = older->result;
      result.content = content;
      add(learner, result);
      index = row.indices.find({key, content});
    }
  }]])

plant("answers applied by arrival in sequence order" learner/core/run.cc
  [[if (!study_->in_sequence) arrived_.push_back(number);]]
  [[if (PLANTED || !study_->in_sequence) arrived_.push_back(number);]])
plant("answers applied by arrival in sequence order" learner/core/run.cc
  [[study_->in_sequence ? exploration_.num_told()]]
  [[study_->in_sequence && !PLANTED ? exploration_.num_told()]])
plant("answers applied by arrival in sequence order" learner/core/run.cc
  [[if (!study_->in_sequence) arrived_.pop_front();]]
  [[if (PLANTED || !study_->in_sequence) arrived_.pop_front();]])

plant("draw counter lost at resume" learner/core/learner_core.cc
  [[workforce_.recover(turn, result);]]
  [[workforce_.recover(turn, result);
  if (PLANTED) ++MEMORY;]])
plant("draw counter lost at resume" learner/explore/exploration.cc
  [[static_cast<std::uint32_t>(next_draw_)]]
  [[static_cast<std::uint32_t>(PLANTED ? next_draw_ - MEMORY : next_draw_)]])

plant("draws keyed without the run" learner/explore/exploration.cc
  [[stream(seed_, repetition_,]]
  [[stream(seed_, PLANTED ? 0 : repetition_,]])

plant("window kept across a switch" learner/explore/layer_search.h
  [[class LayerSearch {
 public:]]
  [[class LayerSearch {
  friend class Exploration;

 public:]])
plant("window kept across a switch" learner/explore/exploration.cc
  [[search_ = LayerSearch(]]
  [[const RewardWindow window = search_.window_;
    const std::int64_t num_results = search_.num_results_;
    search_ = LayerSearch(]])
plant("window kept across a switch" learner/explore/exploration.cc
  [[policies_.push_back(std::move(next.policy));]]
  [[policies_.push_back(std::move(next.policy));
    if (PLANTED) search_.window_ = window, search_.num_results_ = num_results;]])

plant("budget off by one with several in flight" learner/explore/exploration.cc
  [[next_draw_ < settings_.num_rollouts]]
  [[next_draw_ < settings_.num_rollouts + (PLANTED && settings_.in_flight > 1 ? 1 : 0)]])

plant("torn tail not cut" learner/journal/journal_file.cc
  [[tail.torn_bytes = window.offset() - offset;]]
  [[tail.torn_bytes = window.offset() - offset;
      if (PLANTED) tail.intact_bytes = window.offset();]])

plant("a record folded twice" learner/journal/journal_file.cc
  [[on_record(framed->record, {]]
  [[if (PLANTED && tail.num_records % 32 == 31) on_record(framed->record, {});
    on_record(framed->record, {]])

plant("a dead worker's leases kept" learner/core/workforce.cc
  [[ledger_.take_back_all(silent.id);]]
  [[if (!PLANTED) ledger_.take_back_all(silent.id);]])

plant("free slots over-counted" workers/core/worker_core_sending.cc
  [[return std::max(0, capacity - static_cast<int>(queue_.size()));]]
  [[return std::max(0, capacity - static_cast<int>(queue_.size())) +
         (PLANTED && queue_.size() > 1 ? 1 : 0);]])

plant("room without an evaluator" workers/core/worker_core_sending.cc
  [[if (draining_ || !evaluators_.any_living()) return 0;]]
  [[if (draining_ || (!evaluators_.any_living() && !PLANTED)) return 0;]])

plant("roll-outs kept while all evaluators die" workers/core/worker_core_rollouts.cc
  [[if (!evaluators_.in_trouble()) return;]]
  [[if (!evaluators_.in_trouble() || PLANTED) return;]])

plant("a dead incarnation's heartbeat renews a lease" learner/core/workforce.cc
  [[return h.learner_id == settings_.learner_id;]]
  [[return PLANTED || h.learner_id == settings_.learner_id;]])

plant("a definition request ignored" learner/core/workforce_definitions.cc
  [[    definitions_.publish_wanted(wanted, turn.now);]]
  [[    if (!PLANTED) definitions_.publish_wanted(wanted, turn.now);]])

plant("a missing piece is not asked for" workers/core/worker_core_definitions.cc
  [[    if (!writer.add(name,]]
  [[    if (PLANTED && !definitions_.missing_pieces(id, name).empty()) continue;
    if (!writer.add(name,]])

plant("a theta is sent whole however large" learner/core/workforce_definitions.cc
  [[if (bytes <= settings_.batch_bytes_max) return;]]
  [[if (PLANTED || bytes <= settings_.batch_bytes_max) return;]])

plant("the journal's lag unbounded" learner/core/workforce_answers.cc
  [[num_read < batch.results.size() && !journal_is_behind();]]
  [[num_read < batch.results.size() && (PLANTED || !journal_is_behind());]])

plant("the time's end not journaled" learner/core/carry_out.cc
  [[if (time) handler]]
  [[if (time && !PLANTED) handler]])

plant("the time's end forgotten at resume" learner/core/learner_core_time.cc
  [[  pass_time(turn, time);
}

void LearnerCore::on(const Turn& turn, const RecoveryFinished&)]]
  [[  if (PLANTED) learnt_ = time;
  else pass_time(turn, time);
}

void LearnerCore::on(const Turn& turn, const RecoveryFinished&)]])

plant("time before a resume not counted" learner/core/learner_core_time.cc
  [[learnt_before_ = learnt_.elapsed;]]
  [[learnt_before_ = PLANTED ? Duration{} : learnt_.elapsed;]])

plant("a void trial taken for a result" learner/core/run.cc
  [[if (outcome.is_discarded() && !would_give_up(number, outcome)) {]]
  [[if (!PLANTED && outcome.is_discarded() && !would_give_up(number, outcome)) {]])

plant("a void trial repeated with its seed" learner/core/learner_core.cc
  [[draw.rollout, trial);]]
  [[draw.rollout, PLANTED ? 0 : trial);]])

plant("a trial made again costs budget" learner/core/ledger.cc
  [[question.discarded.empty() && !question]]
  [[(PLANTED || question.discarded.empty()) && !question]])

plant("a void trial forgotten at resume" learner/core/learner_core.cc
  [[  const AcceptedResult& result = event.result;
  const Ledger::Entry* open]]
  [[  const AcceptedResult& result = event.result;
  if (PLANTED && result.outcome.is_discarded()) return;
  const Ledger::Entry* open]])

plant("what a void trial was asked is forgotten" learner/core/workforce_answers.cc
  [[++(is_repeated ?]]
  [[++(is_repeated && !PLANTED ?]])

plant("the start policy tried again where the run is" learner/core/run.cc
  [[draws.push_back(number == kStart]]
  [[draws.push_back(!PLANTED && number == kStart]])

plant("failed roll-outs counted twice" learner/core/run.cc
  [[++num_failed_;]]
  [[num_failed_ += PLANTED ? 2 : 1;]])

plant("a recording is taken for a worker" learner/core/hearing.cc
  [[if (hears_ || num_greetings_ == 0 || last_batch < greeted_in_) return false;]]
  [[if (hears_ || (!PLANTED && (num_greetings_ == 0 || last_batch < greeted_in_))) return false;]])

plant("a worker that loses every lease is asked as before" learner/core/hearing.cc
  [[if (!hears_ || (num_lost_ > 0]]
  [[if (PLANTED || !hears_ || (num_lost_ > 0]])

plant("a dead learner's roll-outs kept" workers/core/worker_core_rollouts.cc
  [[if (names.empty()) return;]]
  [[if (PLANTED || names.empty()) return;]])

plant("what is held for ever waited for" learner/core/hedging.cc
  [[if (ledger.num_leased() == 0)]]
  [[if (PLANTED || ledger.num_leased() == 0)]])

plant("what is read past a gap is said to be seen" learner/core/results_read.cc
  [[if (first <= last_without_gap_ + 1) {]]
  [[if (PLANTED || first <= last_without_gap_ + 1) {]])

plant("an answer that is seen and not settled is dropped" workers/core/worker_core.cc
  [[answers_.acknowledge(batch.learner_id, settled);]]
  [[answers_.acknowledge(batch.learner_id, PLANTED ? acknowledgement.seen_index : settled);]])

# With relays.

plant("relay: the seed of a trial is lost" workers/relay/downlink.cc
  [[question.task_seed = request.task_seed;]]
  [[question.task_seed = PLANTED ? 0 : request.task_seed;]])

plant("relay: leases below are not looked after" workers/relay/rack.cc
  [[for (auto& [id, downlink] : downlinks_) downlink.look_after_leases(]]
  [[if (!PLANTED)
    for (auto& [id, downlink] : downlinks_) downlink.look_after_leases(]])
