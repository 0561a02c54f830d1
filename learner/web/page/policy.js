// A policy of one input, layer by layer: Gaussians as ellipses, what each layer alone would do, the
// demonstration, and policies drawn with the exploration noise.
import {by_id, colour, make, set_text, shown} from './net.js';
import {Plot, faint} from './plots.js';

const kDeviations = 2;  // an ellipse covers so many

/** Points of the ellipse of [input; output] at two deviations. */
function ellipse(gaussian, across, up) {
  const dim = gaussian.mean.length;
  const a = gaussian.covariance[across * dim + across];
  const b = gaussian.covariance[across * dim + up];
  const c = gaussian.covariance[up * dim + up];
  // Lower Cholesky factor of the 2 x 2 block.
  const l11 = Math.sqrt(Math.max(a, 0));
  const l21 = l11 > 0 ? b / l11 : 0;
  const l22 = Math.sqrt(Math.max(c - l21 * l21, 0));
  const points = [];
  for (let i = 0; i <= 48; ++i) {
    const angle = i / 48 * 2 * Math.PI;
    const u = kDeviations * Math.cos(angle);
    const v = kDeviations * Math.sin(angle);
    points.push([gaussian.mean[across] + l11 * u, gaussian.mean[up] + l21 * u + l22 * v]);
  }
  return points;
}

export class PolicyPicture {
  constructor() {
    this.plot = new Plot(by_id('policy'));
    this.layer = null;  // null: the finest
    this.output = 0;
    this.what = null;
    by_id('output').onchange = (event) => {
      this.output = Number(event.target.value);
      this.draw();
    };
    by_id('show-noise').onchange = () => this.draw();
    new ResizeObserver(() => this.draw_noise()).observe(by_id('noise'));
  }

  /**
   * what: {title, mean, policy?, noise?, deviations?, start?, demonstration?, columns}
   * mean: of the distribution that is drawn from; policy: one that was executed; start: of the condition.
   */
  set(what) {
    this.what = what;
    this.draw();
  }

  redraw() {
    if (this.what) this.draw();
  }

  draw() {
    const {what} = this;
    if (!what) return;
    set_text(by_id('policy-title'), what.title);
    const model = what.mean || what.policy;
    by_id('policy').hidden = !model || model.input_dim !== 1;
    this.draw_noise();
    if (!model) return;
    this.set_layers(model);
    this.set_outputs(model);
    if (model.input_dim !== 1) {
      set_text(by_id('policy-title'), `${what.title} It has ${model.input_dim} inputs: its outputs are drawn over time beside its motion.`);
      by_id('policy-key').replaceChildren();
      return;
    }
    this.draw_plot(model);
  }

  set_layers(model) {
    const tabs = by_id('layers');
    const count = model.layers.length;
    if (tabs.children.length !== count) {
      tabs.replaceChildren(...model.layers.map((_, i) => make('button', {type: 'button', textContent: `Layer ${i + 1}`, onclick: () => {
        this.layer = i === count - 1 ? null : i;
        this.draw();
      }})));
    }
    [...tabs.children].forEach((tab, i) => tab.setAttribute('aria-pressed', String(i === this.shown_layer(model))));
    tabs.hidden = count === 1;
  }

  shown_layer(model) {
    return this.layer === null ? model.layers.length - 1 : Math.min(this.layer, model.layers.length - 1);
  }

  set_outputs(model) {
    const select = by_id('output');
    this.output = Math.min(this.output, model.output_dim - 1);
    if (select.options.length !== model.output_dim) {
      select.replaceChildren();
      for (let i = 0; i < model.output_dim; ++i) select.append(make('option', {value: String(i)}));
    }
    [...select.options].forEach((option, i) => set_text(option, this.name_of(model, 1 + i)));
    select.value = String(this.output);
    by_id('output-label').hidden = model.output_dim === 1;
  }

  name_of(model, variable) {
    const name = this.what.columns && this.what.columns[variable];
    if (name) return name;
    return variable === 0 ? 'input' : model.output_dim === 1 ? 'output' : `output ${variable}`;
  }

  draw_plot(model) {
    const {what, output} = this;
    const place = this.shown_layer(model);
    const layer = model.layers[place];
    const series = [{stroke: colour('c0'), width: 2.5, points: {show: false}}];
    const tables = [[layer.inputs, layer.outputs[output]]];
    const name = what.mean ? 'mean policy' : 'policy';
    const key = [['c0', place === model.layers.length - 1 ? name : `${name}, layer ${place + 1} alone`]];
    const add = (policy, at, stroke, words, dash = []) => {
      const of = policy && policy.layers[at];
      if (!of || !of.outputs) return;
      series.push({stroke: colour(stroke), width: 1.5, dash, points: {show: false}});
      tables.push([of.inputs, of.outputs[output]]);
      key.push([stroke, words]);
    };
    add(what.start, what.start ? Math.min(place, what.start.layers.length - 1) : 0, 'quiet', 'start policy', [5, 4]);
    if (what.policy && what.mean) add(what.policy, what.policy.layers.length - 1, 'c1', 'this roll-out');
    const draws = by_id('show-noise').checked && what.noise ? what.noise.draws : [];
    if (draws.length) key.push(['c5', 'would be explored']);
    if (layer.gaussians.length) key.push(['c2', `Gaussians, ${kDeviations} deviations`]);
    const samples = what.demonstration;
    if (samples) key.push(['quiet', 'demonstration (points)']);

    const ellipses = layer.gaussians.map((gaussian) => ellipse(gaussian, 0, 1 + output));
    const seen = [...layer.outputs[output]];
    for (const draw of draws) seen.push(...draw[output]);
    for (const points of ellipses) seen.push(...points.map((point) => point[1]));
    if (samples) seen.push(...samples[1 + output]);
    const finite = seen.filter((value) => value !== null && Number.isFinite(value));
    const extent = (low, high) => {
      const all_low = finite.reduce((a, b) => Math.min(a, b), low ?? Infinity);
      const all_high = finite.reduce((a, b) => Math.max(a, b), high ?? -Infinity);
      const margin = .05 * (all_high - all_low || 1);
      return [all_low - margin, all_high + margin];
    };
    const on_draw = (plot) => {
      const {ctx} = plot;
      const ratio = devicePixelRatio || 1;
      const x = (value) => plot.valToPos(value, 'x', true);
      const y = (value) => plot.valToPos(value, 'y', true);
      const path = (points) => {
        ctx.beginPath();
        for (const [across, up] of points) ctx.lineTo(x(across), y(up));
        ctx.stroke();
      };
      ctx.save();
      ctx.beginPath();
      ctx.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
      ctx.clip();
      ctx.setLineDash([]);
      ctx.lineWidth = ratio;
      ctx.strokeStyle = faint(colour('c5'), .55);
      for (const draw of draws) path(what.noise.inputs.map((input, i) => [input, draw[output][i]]));
      ctx.strokeStyle = colour('c2');
      ctx.lineWidth = 1.5 * ratio;
      ctx.fillStyle = faint(colour('c2'), .08);
      for (const points of ellipses) {
        path(points);
        ctx.fill();
      }
      if (samples) {
        ctx.fillStyle = faint(colour('quiet'), .6);
        samples[0].forEach((input, i) => {
          const value = samples[1 + output][i];
          if (value !== null) ctx.fillRect(x(input) - ratio, y(value) - ratio, 2 * ratio, 2 * ratio);
        });
      }
      ctx.restore();
    };
    this.plot.draw({
      key: `${place} ${output} ${series.length} ${this.name_of(model, 0)} ${this.name_of(model, 1 + output)}`,
      series, on_draw, x_title: this.name_of(model, 0), y_title: this.name_of(model, 1 + output), y_range: extent, x_range: () => [model.low, model.high],
    }, uPlot.join(tables));  // eslint-disable-line no-undef
    by_id('policy-key').replaceChildren(...key.map(([stroke, words]) => {
      const mark = make('i');
      mark.style.color = colour(stroke);
      return make('li', {}, mark, words);
    }));
  }

  /** A bar an element of theta. */
  draw_noise() {
    const canvas = by_id('noise');
    const values = (this.what && this.what.deviations) || [];
    canvas.hidden = values.length === 0;
    set_text(by_id('noise-note'), values.length ? `Deviation of each of the ${this.what.theta_dim} elements of theta, on a logarithmic scale from ${shown(Math.min(...values))} to ${shown(Math.max(...values))}.` : 'Shown for the run as it is now.');
    if (!values.length || canvas.clientWidth === 0) return;
    const ratio = devicePixelRatio || 1;
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colour('c5');
    const logs = values.map((value) => Math.log10(Math.max(value, 1e-12)));
    const low = Math.min(...logs) - .3;
    const high = Math.max(...logs, low + 1);
    const step = width / values.length;
    logs.forEach((log, i) => {
      const up = (height - 2) * (log - low) / (high - low);
      context.fillRect(i * step + .1 * step, height - up, Math.max(1, .8 * step), up);
    });
  }
}
