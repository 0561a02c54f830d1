// What the page's tables show of a worker, a run, a roll-out.
import {as_rate, counted, rollout_name, shown} from './net.js';

export const worker_columns = [
  {title: 'host', text: (w) => w.host || '?', words: true},
  {title: 'pid', text: (w) => String(w.pid ?? ''), number: true},
  {title: 'evaluators', text: (w) => counted(w.evaluators), number: true},
  {title: 'pace', text: (w) => as_rate(w.rate_per_s), number: true},
  {title: 'in flight', text: (w) => counted(w.in_flight), number: true},
  {title: 'held', text: (w) => counted(w.held), number: true},
  {title: 'answers', text: (w) => counted(w.accepted), number: true},
  {title: 'failed', text: (w) => counted(w.failed), number: true, bad: (w) => w.failed > 0},
  {title: 'compared', text: (w) => w.compared === undefined ? '–' : w.disagreed > 0 ? `${counted(w.compared)}, ${counted(w.disagreed)} differ` : counted(w.compared), number: true, bad: (w) => w.outvoted > 0},
  {title: 'again', text: (w) => counted(w.repeated), number: true},
  {title: 'restarts', text: (w) => counted(w.restarts), number: true, bad: (w) => w.restarts > 0},
  {title: 'heard', text: (w) => w.silent_s === undefined ? '–' : `${w.silent_s.toFixed(1)} s ago`, number: true},
  {title: 'what is wrong', text: (w) => w.trouble || '', words: true, bad: (w) => Boolean(w.trouble)},
  {title: 'its last failure', text: (w) => w.last_failure || '', words: true},
];
export const reason_columns = [
  {title: 'times', text: (r) => counted(r.count), number: true},
  {title: 'why', text: (r) => r.reason || 'other reasons', words: true},
];
export const failure_columns = [
  {title: 'run', text: (f) => String(f.run), number: true},
  {title: 'roll-out', text: (f) => rollout_name(f.rollout).replace('roll-out ', '')},
  {title: 'status', text: (f) => f.status},
  {title: 'why', text: (f) => f.reason, words: true},
];
export const run_columns = [
  {title: 'run', text: (r) => String(r.run), number: true},
  {title: 'condition', text: (r) => r.condition, words: true},
  {title: 'repetition', text: (r) => String(r.repetition), number: true},
  {title: 'layer', text: (r) => String(r.layer), number: true},
  {title: 'roll-outs', text: (r) => `${counted(r.applied)} / ${counted(r.rollouts)}`, number: true},
  {title: 'best', text: (r) => shown(r.best), number: true},
  {title: 'mean', text: (r) => shown(r.mean), number: true},
  {title: 'last', text: (r) => shown(r.last), number: true},
  {title: 'noise', text: (r) => shown(r.noise), number: true},
  {title: 'failed', text: (r) => counted(r.failed), number: true, bad: (r) => r.failed > 0},
  {title: '', text: (r) => r.done ? 'done' : ''},
];
export const rollout_columns = [
  {title: 'run', text: (r) => String(r.run), number: true},
  {title: 'condition', text: (r) => r.condition, words: true},
  {title: 'roll-out', text: (r) => String(r.rollout), number: true},
  {title: 'layer', text: (r) => String(r.layer), number: true},
  {title: 'reward', text: (r) => shown(r.reward), number: true},
  {title: 'status', text: (r) => r.status, bad: (r) => r.status !== 'ok'},
  {title: 'why', text: (r) => r.reason, words: true},
];
