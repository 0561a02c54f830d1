// A roll-out step by step: what is seen of it, drawn to scale, and its numbers over time.
import {by_id, colour, make, set_text, shown} from './net.js';
import {Plot} from './plots.js';

const still = matchMedia('(prefers-reduced-motion: reduce)');

/** Columns that share a plot: one, and what it ought to be. */
function plots_of(trace) {
  const names = trace.columns;
  const first = [...trace.policy_outputs, ...names.filter((name) => name === 'cost')];
  const order = [...new Set([...first, ...names.slice(1)])];
  return order.filter((name) => name !== names[0] && !(name.startsWith('goal_') && names.includes(name.slice(5))))
    .slice(0, 12)
    .map((name) => ({name, column: names.indexOf(name), goal: names.indexOf(`goal_${name}`)}));
}

/** A body, not links with joints. */
const is_outline = (points) => points.length > 4 && points[0] === points[points.length - 2] && points[1] === points[points.length - 1];
const is_missing = (points, i) => points[i] === null || points[i + 1] === null;

/** Of links and joints; of bodies where there is nothing else. */
function bounds_of(poses, with_outlines = false) {
  const box = {left: Infinity, right: -Infinity, low: Infinity, high: -Infinity};
  for (const pose of poses) {
    for (const points of pose) {
      if (is_outline(points) && !with_outlines) continue;
      for (let i = 0; i + 1 < points.length; i += 2) {
        if (is_missing(points, i)) continue;
        box.left = Math.min(box.left, points[i]);
        box.right = Math.max(box.right, points[i]);
        box.low = Math.min(box.low, points[i + 1]);
        box.high = Math.max(box.high, points[i + 1]);
      }
    }
  }
  return box.left === Infinity && !with_outlines ? bounds_of(poses, true) : box;
}

export class Motion {
  constructor() {
    this.canvas = by_id('motion');
    this.trace = null;
    this.time = 0;
    this.is_playing = !still.matches;
    this.plots = [];
    this.last_frame = null;
    by_id('play').onclick = () => this.play(!this.is_playing);
    by_id('time').oninput = (event) => {
      this.play(false);
      this.go_to(this.begin + (this.end - this.begin) * event.target.value / 1000);
    };
    this.canvas.onkeydown = (event) => {
      const step = (this.end - this.begin) / 50;
      if (event.key === ' ') this.play(!this.is_playing);
      else if (event.key === 'ArrowRight') this.go_to(Math.min(this.end, this.time + step));
      else if (event.key === 'ArrowLeft') this.go_to(Math.max(this.begin, this.time - step));
      else return;
      event.preventDefault();
    };
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.play(this.is_playing);
    requestAnimationFrame((now) => this.frame(now));
  }

  /** null: nothing is to be seen. */
  set(trace) {
    this.trace = trace && trace.data.length > 1 && trace.data[0].length > 0 ? trace : null;
    this.canvas.hidden = !this.trace || trace.poses.length === 0;
    by_id('traces').hidden = by_id('motion-controls').hidden = !this.trace;
    this.clear_plots();
    if (!this.trace) return;
    const times = trace.data[0];
    this.begin = times[0];
    this.end = times[times.length - 1];
    this.time = this.begin;
    this.bounds = trace.poses.length ? bounds_of(trace.poses) : null;
    this.make_plots();
    this.draw();
  }

  clear_plots() {
    for (const {plot} of this.plots) plot.clear();
    this.plots = [];
  }

  make_plots() {
    const {trace} = this;
    this.clear_plots();
    const holder = by_id('traces');
    const wanted = plots_of(trace);
    holder.replaceChildren(...wanted.map(({column}) => make('div', {className: 'trace'}, make('h4', {textContent: trace.titles[column]}), make('div', {className: 'plot'}))));
    this.plots = wanted.map(({column, goal}, place) => {
      const plot = new Plot(holder.children[place].lastChild);
      const hand = make('div', {className: 'hand'});
      const series = [{stroke: colour('c0'), width: 1.5, points: {show: false}}];
      const data = [trace.data[0], trace.data[column]];
      if (goal >= 0) {
        series.push({stroke: colour('quiet'), dash: [5, 4], width: 1.5, points: {show: false}});
        data.push(trace.data[goal]);
      }
      plot.draw({key: trace.columns[column], series, small: true}, data);
      plot.plot.over.append(hand);
      plot.plot.over.addEventListener('click', () => {
        this.play(false);
        this.go_to(plot.plot.posToVal(plot.plot.cursor.left, 'x'));
      });
      return {plot, hand};
    });
  }

  redraw() {
    if (this.trace) this.make_plots();
    this.draw();
  }

  play(is_playing) {
    this.is_playing = is_playing;
    set_text(by_id('play'), is_playing ? 'Stop' : 'Play');
  }

  frame(now) {
    const passed = this.last_frame === null ? 0 : Math.min(.1, (now - this.last_frame) / 1000);
    this.last_frame = now;
    if (this.trace && this.is_playing && !document.hidden) {
      const next = this.time + passed * Number(by_id('speed').value);
      // A breath at the end, then from the begin.
      this.go_to(next > this.end + .8 ? this.begin : next);
    }
    requestAnimationFrame((later) => this.frame(later));
  }

  go_to(time) {
    if (!this.trace) return;
    this.time = time;
    this.draw();
  }

  row() {
    const times = this.trace.data[0];
    let low = 0;
    let high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= this.time) low = middle; else high = middle - 1;
    }
    return low;
  }

  draw() {
    if (!this.trace) return;
    const time = Math.min(this.time, this.end);
    const row = this.row();
    by_id('time').value = Math.round(1000 * (time - this.begin) / (this.end - this.begin || 1));
    set_text(by_id('time-text'), shown(time));
    for (const {plot, hand} of this.plots) hand.style.transform = `translateX(${plot.plot.valToPos(time, 'x')}px)`;
    if (this.bounds) this.draw_pose(row);
  }

  draw_pose(row) {
    const {canvas, bounds, trace} = this;
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (width === 0) return;
    const ratio = devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const margin = 22;
    const span_x = Math.max(bounds.right - bounds.left, 1e-6);
    const span_y = Math.max(bounds.high - bounds.low, 1e-6);
    const scale = Math.min((width - 2 * margin) / span_x, (height - 2 * margin) / span_y);
    const x = (value) => width / 2 + (value - (bounds.left + bounds.right) / 2) * scale;
    const y = (value) => height / 2 - (value - (bounds.low + bounds.high) / 2) * scale;
    const path = (points) => {
      context.beginPath();
      for (let i = 0; i + 1 < points.length; i += 2) {
        if (!is_missing(points, i)) context.lineTo(x(points[i]), y(points[i + 1]));
      }
      context.stroke();
    };
    context.lineCap = context.lineJoin = 'round';
    context.strokeStyle = colour('grid');
    context.lineWidth = 1;
    if (bounds.low <= 0 && bounds.high >= 0) path([-1e6 / scale + bounds.left, 0, 1e6 / scale + bounds.right, 0]);
    // Where the last point came from.
    const pose = trace.poses[row];
    const tail = pose.length - 1;
    context.strokeStyle = colour('c1');
    for (let i = Math.max(1, row - 60); i <= row; ++i) {
      const before = trace.poses[i - 1][tail];
      const now = trace.poses[i][tail];
      if (!before || !now || now.length < 2) continue;
      context.globalAlpha = .6 * (1 - (row - i) / 61);
      path([...before.slice(-2), ...now.slice(-2)]);
    }
    context.globalAlpha = 1;
    pose.forEach((points, place) => {
      context.strokeStyle = place === 0 ? colour('ink') : colour('c0');
      context.lineWidth = 4;
      path(points);
    });
    context.fillStyle = colour('sheet');
    context.strokeStyle = colour('ink');
    context.lineWidth = 1.5;
    for (const points of pose) {
      if (is_outline(points)) continue;
      for (let i = 0; i + 1 < points.length; i += 2) {
        if (is_missing(points, i)) continue;
        context.beginPath();
        context.arc(x(points[i]), y(points[i + 1]), 3.5, 0, 2 * Math.PI);
        context.fill();
        context.stroke();
      }
    }
    // What a metre is.
    const unit = [.01, .02, .05, .1, .2, .5, 1, 2, 5, 10, 20, 50, 100].find((each) => each * scale > 45) || 1;
    context.strokeStyle = context.fillStyle = colour('quiet');
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(12, height - 10);
    context.lineTo(12 + unit * scale, height - 10);
    context.stroke();
    context.font = '11px sans-serif';
    context.fillText(`${unit} m`, 14, height - 14);
  }
}
