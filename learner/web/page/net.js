// Asking the server, and the words for numbers. Text from outside only ever becomes textContent.

/** Nobody answers. */
export class Unreachable extends Error {}

/** {status, data}; data is null for what is no JSON. Throws Unreachable. */
export async function get(address) {
  const stop = new AbortController();
  const timer = setTimeout(() => stop.abort(), 20000);
  try {
    const response = await fetch(address, {signal: stop.signal, credentials: 'same-origin'});
    const is_json = (response.headers.get('Content-Type') || '').startsWith('application/json');
    return {status: response.status, data: is_json ? await response.json() : null};
  } catch (error) {
    throw new Unreachable(error.message);
  } finally {
    clearTimeout(timer);
  }
}

export const by_id = (id) => document.getElementById(id);

export function set_text(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

/** A reward, or any number of which three digits matter. */
export function shown(number) {
  if (number === null || number === undefined || !Number.isFinite(number)) return '–';
  const size = Math.abs(number);
  if (number === 0) return '0';
  if (size < 1e-3 || size >= 1e6) return number.toExponential(2);
  return size >= 100 ? String(Math.round(number)) : size >= 10 ? number.toFixed(1) : number.toFixed(3);
}

export function counted(number) {
  return number === null || number === undefined ? '–' : number.toLocaleString('en');
}

export function as_time(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return '–';
  if (seconds < 100) return `${seconds.toFixed(0)} s`;
  if (seconds < 6000) return `${(seconds / 60).toFixed(0)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

export function as_rate(per_s) {
  if (!per_s) return '–';
  if (per_s >= 1) return `${shown(per_s)} /s`;
  return per_s * 60 >= 1 ? `${shown(per_s * 60)} /min` : `${shown(per_s * 3600)} /h`;
}

/** The name of a roll-out by its number. */
export function rollout_name(number) {
  if (number === -2) return 'start policy';
  return number < 0 ? 'final policy' : `roll-out ${number}`;
}

/** The value of a colour of page.css. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export const condition_colour = (place) => colour(`c${place % 8}`);
/** Of the same colour a second time round: another dash. */
export const condition_dash = (place) => [[], [8, 4], [2, 3], [10, 3, 2, 3]][Math.floor(place / 8) % 4];
