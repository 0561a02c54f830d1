// uPlot with our colours: a plot that follows its element's width, and is made anew when the theme
// or its series change.
/* global uPlot */
import {colour, condition_colour, condition_dash} from './net.js';

function axes(x_title, y_title, small) {
  const look = {stroke: colour('quiet'), grid: {stroke: colour('grid'), width: 1}, ticks: {stroke: colour('grid'), width: 1}, font: `${small ? 10 : 12}px sans-serif`, labelFont: '12px sans-serif'};
  const x = {...look, label: x_title, labelSize: x_title ? 18 : 0, size: small ? 26 : 28, space: small ? 40 : 60};
  const y = {...look, label: y_title, labelSize: y_title ? 18 : 0, size: small ? 44 : 54, space: small ? 22 : 40, values: (_, marks) => marks.map((mark) => mark === null ? '' : String(+mark.toPrecision(6)))};
  if (!x_title) delete x.label;
  if (!y_title) delete y.label;
  return [x, y];
}

/** A uPlot in an element. draw({key, series, bands, x_title, ...}, data): the same key keeps the plot. */
export class Plot {
  constructor(element) {
    this.element = element;
    this.plot = null;
    this.key = null;
    this.options = null;
    new ResizeObserver(() => this.fit()).observe(element);
  }

  fit() {
    const {clientWidth: width, clientHeight: height} = this.element;
    if (this.plot && width > 0 && (width !== this.plot.width || height !== this.plot.height)) this.plot.setSize({width, height});
  }

  draw(options, data) {
    const key = `${options.key} ${document.documentElement.dataset.theme}`;
    this.last = [options, data];
    if (this.plot && key === this.key) {
      this.options = options;
      this.plot.setData(data);
      return;
    }
    this.clear();
    this.last = [options, data];
    this.key = key;
    this.options = options;
    const small = Boolean(options.small);
    this.plot = new uPlot({
      width: this.element.clientWidth || 300,
      height: this.element.clientHeight || 200,
      legend: {show: false},
      cursor: {y: false, points: {show: !small}, drag: {x: true, y: false}, ...(options.sync ? {sync: {key: options.sync}} : {})},
      scales: {x: {time: false, ...(options.x_range ? {range: (u, low, high) => this.options.x_range(low, high)} : {})}, y: {...(options.y_range ? {range: (u, low, high) => this.options.y_range(low, high)} : {})}},
      axes: axes(options.x_title, options.y_title, small),
      series: [{}, ...options.series],
      bands: options.bands || [],
      hooks: {
        draw: [(plot) => this.options.on_draw && this.options.on_draw(plot)],
        setCursor: [(plot) => this.options.on_cursor && this.options.on_cursor(plot)],
      },
    }, data, this.element);
  }

  /** In the colours of another theme. */
  redraw() {
    if (this.last) this.draw(...this.last);
  }

  clear() {
    if (this.plot) this.plot.destroy();
    this.plot = null;
    this.last = null;
  }
}

export function line(place, properties = {}) {
  return {stroke: condition_colour(place), dash: condition_dash(place), width: 2, points: {show: false}, ...properties};
}

export const no_line = {stroke: 'transparent', width: 0, points: {show: false}};

/** "#rrggbb" at an opacity. */
export function faint(hex, opacity) {
  const value = parseInt(hex.slice(1), 16);
  return `rgba(${value >> 16},${(value >> 8) & 255},${value & 255},${opacity})`;
}

/** Learning curves of the conditions that are shown; a dotted upright where half of the runs had left a layer. */
export function curves_plot(conditions, curves, hidden, measure) {
  const series = [];
  const bands = [];
  const tables = [];
  const uprights = [];
  let last = 10;  // of the roll-outs that there are
  conditions.forEach((condition, place) => {
    const of = curves[place];
    if (hidden.has(condition.name) || !of) return;
    const has_band = measure !== 'best';
    const table = [of.rollout, of[measure]];
    // One point alone makes no line: the first is shown as what it is.
    const is_short = (plot, i) => plot.data[i].reduce((count, value) => count + (value !== null && value !== undefined), 0) < 3;
    series.push(line(place, {points: {show: is_short, size: 7, fill: condition_colour(place), stroke: condition_colour(place)}}));
    if (has_band) {
      table.push(of.high, of.low);
      bands.push({series: [series.length + 1, series.length + 2], fill: faint(condition_colour(place), .16)});
      series.push(no_line, no_line);
    }
    tables.push(table);
    const ends = of.mean.findLastIndex((value) => value !== null);
    if (ends >= 0) last = Math.max(last, of.rollout[ends] + of.rollouts_per_point / 2);
    for (const {median} of condition.switches) uprights.push([median, condition_colour(place)]);
  });
  const on_draw = (plot) => {
    const {ctx} = plot;
    ctx.save();
    ctx.setLineDash([2, 4]);
    ctx.lineWidth = 1.5;
    for (const [rollout, stroke] of uprights) {
      const x = plot.valToPos(rollout, 'x', true);
      if (x < plot.bbox.left || x > plot.bbox.left + plot.bbox.width) continue;
      ctx.strokeStyle = stroke;
      ctx.beginPath();
      ctx.moveTo(x, plot.bbox.top);
      ctx.lineTo(x, plot.bbox.top + plot.bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const key = `${measure} ${conditions.map((each) => hidden.has(each.name) ? 0 : 1).join('')}`;
  return [{key, series, bands, x_title: 'roll-outs', y_title: 'reward', on_draw, x_range: () => [1, last]}, tables.length ? uPlot.join(tables) : [[]]];
}

/** One run: the mean over neighbouring roll-outs, their range, switches, failures. */
export function run_plot(run) {
  const place = run.condition_index;
  const {rewards} = run;
  const switches = run.switches;
  const on_draw = (plot) => {
    const {ctx} = plot;
    const bottom = plot.bbox.top + plot.bbox.height;
    ctx.save();
    ctx.strokeStyle = colour('quiet');
    ctx.setLineDash([2, 4]);
    for (const rollout of switches) {
      const x = plot.valToPos(rollout + 1.5, 'x', true);
      ctx.beginPath();
      ctx.moveTo(x, plot.bbox.top);
      ctx.lineTo(x, bottom);
      ctx.stroke();
    }
    ctx.setLineDash([]);
    ctx.strokeStyle = colour('bad');
    ctx.lineWidth = 2;
    rewards.failed.forEach((failed, i) => {
      if (!failed) return;
      const x = plot.valToPos(rewards.rollout[i], 'x', true);
      ctx.beginPath();
      ctx.moveTo(x, bottom);
      ctx.lineTo(x, bottom - 8 * devicePixelRatio);
      ctx.stroke();
    });
    ctx.restore();
  };
  const points = {show: rewards.rollouts_per_point === 1, size: 4, fill: condition_colour(place), stroke: condition_colour(place)};
  return [
    {key: `run ${run.run} ${rewards.rollouts_per_point}`, on_draw, x_title: 'roll-outs', y_title: 'reward', bands: [{series: [2, 3], fill: faint(condition_colour(place), .18)}],
      series: [line(place, {width: rewards.rollouts_per_point === 1 ? 1 : 2, points}), no_line, no_line]},
    [rewards.rollout, rewards.mean, rewards.high, rewards.low],
  ];
}

export function rates_plot(rates) {
  const data = [rates.map((_, i) => i - rates.length + 1), rates];
  return [{key: 'rates', series: [line(0, {width: 1.5, fill: faint(condition_colour(0), .15)})], small: true, y_range: (low, high) => [0, high > 0 ? high * 1.1 : 1]}, data];
}
