// What is said above everything else.
import {by_id, counted, make, set_text} from './net.js';

/** What the server's refusals mean for who looks at the page. */
export const refusals = {
  401: 'The learner asks for a token now: open /?token=TOKEN.',
  403: 'The learner does not answer pages of other sites.',
  421: 'The learner does not know this name as its own: take its address, or localhost.',
  500: 'The learner cannot say how it stands: its log says why.',
};

const several = (number, one, more) => `${counted(number)} ${number === 1 ? one : more}`;

/** What is wrong, and what whoever looks may have to do: above everything else. */
export function alerts(page) {
  const {state} = page;
  const said = [];
  const has_ended = page.failures_to_reach > 1 && state && state.stage === 'done' && !page.study.is_replay;
  if (has_ended) said.push(['', `The study is done and its learner has ended. This page lives on with: treeroll-replay ${page.study.directory} --http PORT`]);
  else if (page.failures_to_reach > 1 && page.refusal) said.push(['bad', page.refusal]);
  else if (page.failures_to_reach > 1) said.push(['bad', page.study && page.study.is_replay ? 'treeroll-replay does not answer. The page shows what it said last.' : 'The learner does not answer: it has ended, was stopped, or cannot be reached. The page shows what it said last, and goes on when it is back.']);
  if (state && state.failure) said.push(['bad', state.failure]);
  if (state && state.waiting_for && state.stage === 'learning') said.push(['', `Waiting: ${state.waiting_for}`]);
  if (state && state.ledger.conflicting > 0) said.push(['bad', `${several(state.ledger.conflicting, 'answer contradicts', 'answers contradict')} another one to the same roll-out, of a worker of the same numeric class: one of the two is broken.`]);
  if (state && state.rechecks && state.rechecks.outvoted_workers > 0) said.push(['bad', `${several(state.rechecks.outvoted_workers, 'worker is', 'workers are')} contradicted by two others: treeroll-replay DIR --without-worker suspects --state-dir NEW folds the study without them.`]);
  const classes = state ? Object.keys(state.classes).length : 0;
  if (classes > 1) said.push(['', `Results come from ${classes} numeric classes: bits depend on who evaluated what.`]);
  const troubled = state ? state.workers.filter((worker) => worker.trouble && !worker.gone) : [];
  if (troubled.length) said.push(['', `${troubled.length} of ${several(state.num_workers, 'worker', 'workers')}: ${troubled[0].host || troubled[0].id}: ${troubled[0].trouble}`]);
  const holder = by_id('alerts');
  while (holder.children.length > said.length) holder.lastChild.remove();
  while (holder.children.length < said.length) holder.append(make('p'));
  said.forEach(([kind, text], i) => {
    holder.children[i].className = `alert ${kind}`;
    set_text(holder.children[i], text);
  });
}
