// The page: asks the server twice a second, and shows what has changed.
import {Unreachable, as_rate, as_time, by_id, condition_colour, counted, get, make, rollout_name, set_text, shown} from './net.js';
import {alerts, refusals} from './alerts.js';
import {failure_columns, reason_columns, rollout_columns, run_columns, worker_columns} from './columns.js';
import {Motion} from './motion.js';
import {Plot, curves_plot, rates_plot, run_plot} from './plots.js';
import {PolicyPicture} from './policy.js';
import {fill, fill_list} from './tables.js';

const kPeriod = 500;
const kHiddenPeriod = 5000;

const page = {
  study: null, state: null, curves: null, run: null, conditions: new Map(),
  incarnation: null, refusal: null, versions: {}, hidden: new Set(), failures_to_reach: 0,
  run_index: 0, follows: true, shown: null, shown_key: '', shown_text: null, wanted_key: '', runs_from: 0, rollouts_next: null, rollouts_from: '',
};
const plots = {curves: new Plot(by_id('curves')), run: new Plot(by_id('run')), rates: new Plot(by_id('rates'))};
const motion = new Motion();
const policy = new PolicyPicture();

// Theme: that of the system until a person chooses.
function set_theme(theme) {
  document.documentElement.dataset.theme = theme;
  set_text(by_id('theme'), theme === 'dark' ? 'Light' : 'Dark');
  for (const plot of Object.values(plots)) plot.redraw();
  motion.redraw();
  policy.redraw();
  if (page.state) show_legend();
}
const prefers_dark = matchMedia('(prefers-color-scheme: dark)');
const chosen_theme = () => { try { return localStorage.getItem('theme'); } catch { return null; } };
prefers_dark.onchange = () => { if (!chosen_theme()) set_theme(prefers_dark.matches ? 'dark' : 'light'); };
by_id('theme').onclick = () => {
  const theme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  try { localStorage.setItem('theme', theme); } catch { /* private window */ }
  set_theme(theme);
};

function show_head() {
  const {state} = page;
  const stage = page.failures_to_reach > 1 && state.stage !== 'done' ? 'gone' : state.stage === 'learning' && state.waiting_for ? 'waiting' : state.stage;
  set_text(by_id('stage'), stage === 'gone' ? 'does not answer' : stage);
  by_id('stage').className = `pill ${stage}`;
  const done = state.ledger.applied + state.evaluated;
  const all = state.rollouts + state.evaluations;
  const share = all ? 100 * done / all : 0;
  by_id('progress').setAttribute('aria-valuenow', share.toFixed(0));
  by_id('progress').firstElementChild.style.width = `${share}%`;
  const facts = [
    ['roll-outs', `${counted(done)} of ${counted(all)} (${share.toFixed(0)} %)`],
    ['runs done', `${counted(state.runs_done)} of ${counted(state.runs)}`],
    ['best reward', shown(state.best_reward || null)],
    ['failed', counted(state.ledger.failed)],
  ];
  if (!page.study.is_replay) {
    facts.splice(2, 0, ['workers', `${counted(state.workers_joined)}, ${counted(state.evaluators)} evaluators`], ['pace', as_rate(state.rate_per_s)], ['left', as_time(state.left_s)], ['learning for', as_time(state.elapsed_s)]);
  }
  fill_list(by_id('facts'), facts);
  document.title = `${share.toFixed(0)} % ${page.study ? page.study.name : 'treeroll'}`;
}

function show_legend() {
  const holder = by_id('legend');
  const {conditions} = page.state;
  if (holder.children.length !== conditions.length) {
    holder.replaceChildren(...conditions.map((condition) => make('button', {type: 'button', title: condition.name, onclick: () => {
      if (!page.hidden.delete(condition.name)) page.hidden.add(condition.name);
      show_legend();
      show_curves();
    }}, make('i'), make('span'), make('em'))));
  }
  conditions.forEach((condition, i) => {
    const button = holder.children[i];
    button.setAttribute('aria-pressed', String(!page.hidden.has(condition.name)));
    button.children[0].style.color = condition_colour(i);
    set_text(button.children[1], condition.name);
    set_text(button.children[2], shown(condition.mean_best));
  });
}

function show_curves() {
  if (!page.curves || !page.state) return;
  const measure = by_id('measure').value;
  plots.curves.draw(...curves_plot(page.state.conditions, page.curves.conditions, page.hidden, measure));
  const widths = [...new Set(page.curves.conditions.map((each) => each.rollouts_per_point))].filter((width) => width > 1);
  set_text(by_id('curves-note'), `${measure === 'best' ? 'The highest reward of a run up to each roll-out: its mean over runs.' : 'Over those runs of each condition that have come so far; the band holds the middle half.'}${widths.length ? ` Each point is over ${widths.join(' or ')} roll-outs.` : ''} Dotted: where half of the runs had left a layer. Beside the names: the mean of the runs' best rewards.`);
}

function show_tables() {
  const {state} = page;
  const is_live = !page.study.is_replay;
  by_id('ledger-section').hidden = !is_live;
  fill(by_id('workers'), worker_columns, state.workers, {empty: is_live ? 'No worker is heard.' : 'A journal names only who has answered.'});
  set_text(by_id('workers-note'), state.num_workers > state.workers.length ? `${state.workers.length} of ${counted(state.num_workers)} are listed.` : '');
  fill(by_id('reasons'), reason_columns, state.reasons, {empty: 'No roll-out has failed.'});
  fill(by_id('failures'), failure_columns, state.failures, {empty: 'None.', choose: (failure) => show_rollout(failure.run, failure.rollout)});
  set_text(by_id('failures-note'), state.num_failures ? `${counted(state.num_failures)} failures and void trials in all.` : '');
  const names = {issued: 'drawn', applied: 'learnt from', pending: 'pending', leased: 'with workers', ready: 'ready', reissued: 'issued again', late: 'late', duplicate: 'answered twice', rejected: 'refused answers', unasked: 'answers of strangers', conflicting: 'in conflict', failed: 'failed', discarded: 'void trials', unsynced: 'not on disk yet'};
  fill_list(by_id('ledger'), Object.entries(names).map(([key, name]) => [name, counted(state.ledger[key])]));
  if (state.rates.length > 1) plots.rates.draw(...rates_plot(state.rates));
}

/** Another study answers here now: nothing of the one before is shown under its name. */
function forget_study() {
  Object.assign(page, {curves: null, run: null, run_index: 0, follows: true, shown: null, shown_key: '', shown_text: null, wanted_key: '', runs_from: 0, rollouts_next: null, rollouts_from: ''});
  page.hidden.clear();
  motion.set(null);
  by_id('legend').replaceChildren();
}

async function begin_anew() {
  const {status, data} = await get('/api/study');
  if (!data) throw new Unreachable(`the study is answered with status ${status}`);
  // Of a study that was extended the runs have other numbers.
  if (page.study && (page.study.directory !== data.directory || page.study.repetitions !== data.repetitions)) forget_study();
  page.study = data;
  page.incarnation = data.incarnation;
  page.versions = {};
  page.conditions.clear();
  set_text(by_id('study'), data.name);
  set_text(by_id('foot'), `treeroll ${data.program}, ${data.is_replay ? 'read from' : 'written to'} ${data.directory}, seed ${data.seed}`);
  for (const id of ['runs-condition', 'rollouts-condition']) {
    const select = by_id(id);
    select.replaceChildren(make('option', {value: '', textContent: 'all'}), ...data.conditions.map((condition, i) => make('option', {value: String(i), textContent: condition.name})));
  }
  by_id('shown-run').max = data.conditions.length * data.repetitions - 1;
}

async function condition_facts(place) {
  if (!page.conditions.has(place)) {
    const {status, data} = await get(`/api/conditions/${place}`);
    if (!data) throw new Unreachable(`a condition is answered with status ${status}`);
    page.conditions.set(place, data);
  }
  return page.conditions.get(place);
}

/**
 * Asks for an address only where something has been told since, and shows the answer. The version is
 * noted once it is shown: what fails is asked for again, also where nothing is told any more.
 */
async function show_news(what, version, address, show) {
  if (page.versions[what] === version) return;
  const asked = page.versions[what] = Symbol(what);
  const answer = await get(address);
  if (answer.status >= 500) return;
  await show(answer);
  // A click in between asks anew.
  if (page.versions[what] === asked) page.versions[what] = version;
}

function look_at_curves() {
  return show_news('curves', page.state.version, '/api/curves', ({data}) => {
    if (data) page.curves = data;
    show_curves();
  });
}

function look_at_runs() {
  const query = new URLSearchParams({condition: by_id('runs-condition').value, order: by_id('runs-order').value, from: page.runs_from});
  return show_news('runs', `${page.state.version} ${query}`, `/api/runs?${query}`, show_runs);
}

function show_runs({data}) {
  if (!data) return;
  fill(by_id('runs'), run_columns, data.runs, {empty: 'There are no runs.', choose: (run) => choose_run(run.run), chosen: (run) => run.run === page.run_index});
  const last = Math.min(data.num, data.from + data.per_page);
  set_text(by_id('runs-place'), data.num ? `${data.from + 1} to ${last} of ${counted(data.num)}` : '');
  by_id('runs-before').disabled = data.from === 0;
  by_id('runs-after').disabled = last >= data.num;
  page.runs_per_page = data.per_page;
}

/** What a final policy is worth: the mean of its evaluations, of which one that failed counts with 0. */
function final_words(final) {
  if (final.wanted === 1) return final.status === 'ok' ? shown(final.reward) : final.status;
  const reward = final.reward === null ? 'without a reward' : shown(final.reward);
  const failed = final.failed ? `, ${final.failed} failed: ${final.status}` : '';
  return `${reward}, the mean of ${final.evaluations} of ${final.wanted} evaluations${failed}`;
}

function look_at_run() {
  return show_news('run', `${page.state.version} ${page.run_index}`, `/api/runs/${page.run_index}`, show_run);
}

async function show_run({data}) {
  if (!data) return;
  page.run = data;
  plots.run.draw(...run_plot(data));
  set_text(by_id('run-title'), `Run ${data.run}: ${data.condition}, repetition ${data.repetition}`);
  const said = [`Layer ${data.layer}`];
  if (data.switches.length) said.push(`left after ${data.switches.map((each) => each + 1).join(', ')} roll-outs`);
  if (data.start) said.push(`start policy ${data.start.status === 'ok' ? shown(data.start.reward) : data.start.status}`);
  if (data.final) said.push(`final policy ${final_words(data.final)}`);
  if (data.failed) said.push(`${counted(data.failed)} failed (red marks)`);
  set_text(by_id('run-note'), `${said.join('; ')}.`);
  set_slider();
  await show_policy();
}

function set_slider() {
  const slider = by_id('shown-number');
  slider.max = Math.max(0, page.run.applied - 1);
}

/** The policy of the shown roll-out, or, while the best is followed, that of its run as it is now. */
async function show_policy() {
  const {run, shown: rollout} = page;
  if (!run) return;
  const facts = await condition_facts(run.condition_index);
  const again = rollout && rollout.again;
  const trace = again && again.trace;
  const columns = facts.columns.length ? facts.columns : trace ? [...trace.policy_inputs, ...trace.policy_outputs].map((name) => trace.titles[trace.columns.indexOf(name)]) : [];
  const common = {start: facts.policy, demonstration: facts.demonstration, columns};
  if (rollout && !page.follows && rollout.run === run.run) {
    policy.set({...common, title: `${rollout.condition}, repetition ${rollout.repetition}: ${rollout_name(rollout.rollout)} of layer ${rollout.layer}.`, mean: rollout.mean, policy: rollout.policy, noise: rollout.noise});
    return;
  }
  const best = rollout && rollout.run === run.run ? rollout.policy : null;
  policy.set({...common, title: `${run.condition}, repetition ${run.repetition}: as it is now, layer ${run.layer} is explored.`, mean: run.now.policy, policy: best, noise: run.now.noise, deviations: run.now.deviations, theta_dim: run.now.theta_dim});
}

function choose_run(run) {
  page.follows = by_id('follow').checked = false;
  page.run_index = run;
  by_id('shown-run').value = run;
  page.versions.runs = page.versions.run = null;
  tick_soon();
}

/** Wants a roll-out to be shown; it is asked for until it is there. */
function show_rollout(run, number, follows = false) {
  page.follows = by_id('follow').checked = follows;
  page.run_index = run;
  by_id('shown-run').value = run;
  if (number >= 0) {
    by_id('shown-number').max = Math.max(Number(by_id('shown-number').max), number);
    by_id('shown-number').value = number;
  }
  set_text(by_id('shown-number-text'), number >= 0 ? String(number) : '–');
  page.wanted_key = `${run}/${number}`;
  // A click on what could not be shown tries it again.
  if (!page.shown || (page.shown.again && page.shown.again.failure)) page.shown_key = '';
  page.versions.runs = page.versions.run = null;
  tick_soon();
}

function best_of_all() {
  const bests = page.state.conditions.map((condition) => condition.best).filter(Boolean);
  return bests.sort((a, b) => b.reward - a.reward)[0];
}

function best_of_run() {
  if (page.run && page.run.run === page.run_index && page.run.best_rollout >= 0) return page.run.best_rollout;
  return null;
}

async function look_at_rollout() {
  if (page.follows) {
    const best = best_of_all();
    if (best && `${best.run}/${best.rollout}` !== page.wanted_key) show_rollout(best.run, best.rollout, true);
  }
  if (!page.wanted_key || page.wanted_key === page.shown_key) return;
  const key = page.wanted_key;
  const {status, data} = await get(`/api/rollouts/${key}`);
  if (key !== page.wanted_key) return;
  if (status === 202) {
    if (!page.follows || !page.shown) set_text(by_id('shown-title'), `Run ${key.replace('/', ', roll-out ')} is being simulated once more ...`);
    return;
  }
  // Without a result yet it is asked again: the server makes it anew.
  const is_final = !data || data.status !== null;
  page.shown_key = is_final ? key : null;
  const text = is_final ? null : `${key} ${JSON.stringify(data)}`;
  if (text && text === page.shown_text) return;
  page.shown_text = text;
  if (!data || data.failure) {
    page.shown = null;
    motion.set(null);
    set_text(by_id('shown-title'), `Run ${key.replace('/', ', roll-out ')} cannot be shown: ${data ? data.failure : 'the server refused'}`);
    return;
  }
  page.shown = data;
  const outcome = data.status === null ? 'it has no result yet' : data.status === 'ok' ? `reward ${shown(data.reward)}` : `${data.status}: ${data.reason}`;
  const again = data.again || {};
  const remark = again.failure ? ` It is not simulated here: ${again.failure}.` : again.trace ? '' : ' Its task records no trace.';
  const terms = Object.entries(again.terms || {}).map(([name, number]) => `${name} ${number === null ? 'not a number' : shown(number)}`);
  const made_of = terms.length ? ` Made of: ${terms.join(', ')}.` : '';
  set_text(by_id('shown-title'), `${page.follows ? 'The best: ' : ''}${data.condition}, run ${data.run}, ${rollout_name(data.rollout)}, layer ${data.layer}: ${outcome}.${made_of}${remark}`);
  motion.set(again.trace || null);
  await show_policy();
}

function look_at_rollouts() {
  const value = (id) => by_id(`rollouts-${id}`).value.trim();
  const order = value('order');
  const query = new URLSearchParams({run: value('run'), condition: value('condition'), status: value('status'), layer: value('layer'), reward_min: value('reward') || '0', order, from: order === 'number' ? page.rollouts_from : ''});
  return show_news('rollouts', `${page.state.version} ${query}`, `/api/rollouts?${query}`, show_rollouts);
}

/** What a table of roll-outs has not looked at, or leaves out. */
function rollouts_note(data) {
  const said = [];
  if (data.last) said.push(`Of the last ${counted(data.last)} roll-outs`);
  if (data.is_cut) said.push(`the newest ${counted(data.rollouts.length)} that fit`);
  return said.length ? `${said.join(', ')}. The order "by number" looks at all.` : '';
}

function show_rollouts({status, data}) {
  const rows = data ? data.rollouts : [];
  let empty = 'No roll-out fits.';
  if (status === 400) empty = 'The filter is not understood: run and layer are whole numbers, the reward is a number.';
  else if (data && data.last) empty = `None of the last ${counted(data.last)} roll-outs fits.`;
  else if (data && data.next) empty = 'None of those looked at so far fits.';
  set_text(by_id('rollouts-note'), data ? rollouts_note(data) : '');
  fill(by_id('rollouts'), rollout_columns, rows, {empty, choose: (row) => show_rollout(row.run, row.rollout), chosen: (row) => `${row.run}/${row.rollout}` === page.wanted_key});
  page.rollouts_next = data && data.next;
  by_id('rollouts-more').hidden = !page.rollouts_next && !page.rollouts_from;
  set_text(by_id('rollouts-more'), page.rollouts_next ? 'Go on' : 'From the begin');
}

let timer = null;
let is_looking = false;

async function look() {
  page.refusal = null;
  const {status, data} = await get('/api/state');
  page.refusal = data ? null : refusals[status] || `The server answers with status ${status}.`;
  if (!data) throw new Unreachable(page.refusal);
  if (page.incarnation !== data.incarnation) await begin_anew();
  page.failures_to_reach = 0;
  page.state = data;
  by_id('main').hidden = false;
  show_head();
  alerts(page);
  show_legend();
  show_tables();
  await look_at_curves();
  await look_at_rollout();
  await look_at_run();
  await look_at_runs();
  await look_at_rollouts();
}

async function tick() {
  if (is_looking) return;
  is_looking = true;
  clearTimeout(timer);
  try {
    await look();
  } catch (error) {
    if (!(error instanceof Unreachable)) throw error;
    ++page.failures_to_reach;
    if (page.state) show_head();
    alerts(page);
  } finally {
    is_looking = false;
    const wait = page.failures_to_reach > 3 ? 2000 : kPeriod;
    timer = setTimeout(tick, document.hidden ? kHiddenPeriod : wait);
  }
}

function tick_soon() {
  if (is_looking) return;
  clearTimeout(timer);
  timer = setTimeout(tick, 60);
}

by_id('measure').onchange = show_curves;
by_id('follow').onchange = (event) => {
  page.follows = event.target.checked;
  tick_soon();
};
by_id('shown-run').onchange = (event) => {
  const run = Number(event.target.value);
  if (Number.isInteger(run) && run >= 0 && run <= Number(event.target.max)) choose_run(run);
};
by_id('shown-number').oninput = (event) => set_text(by_id('shown-number-text'), event.target.value);
by_id('shown-number').onchange = (event) => show_rollout(page.run_index, Number(event.target.value));
by_id('show-start').onclick = () => show_rollout(page.run_index, -2);
by_id('show-best').onclick = () => {
  const best = best_of_run();
  if (best !== null) show_rollout(page.run_index, best);
};
for (const id of ['runs-condition', 'runs-order']) by_id(id).onchange = () => { page.runs_from = 0; tick_soon(); };
by_id('runs-before').onclick = () => { page.runs_from = Math.max(0, page.runs_from - page.runs_per_page); tick_soon(); };
by_id('runs-after').onclick = () => { page.runs_from += page.runs_per_page; tick_soon(); };
by_id('rollouts-form').onsubmit = (event) => event.preventDefault();
by_id('rollouts-form').onchange = () => { page.rollouts_from = ''; tick_soon(); };
by_id('rollouts-more').onclick = () => { page.rollouts_from = page.rollouts_next || ''; tick_soon(); };
document.onvisibilitychange = () => { if (!document.hidden) tick_soon(); };

set_theme(chosen_theme() || (prefers_dark.matches ? 'dark' : 'light'));
tick();
