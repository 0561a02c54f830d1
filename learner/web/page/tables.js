// Tables whose rows are kept and only their words changed, so that focus and place stay.
import {make, set_text} from './net.js';

/**
 * columns: [{title, text(row), number?: bool, words?: bool, bad?(row)}]
 * options: {choose?(row), chosen?(row), empty: text}
 */
export function fill(table, columns, rows, options) {
  if (!table.tHead) {
    const cells = columns.map((column) => make('th', {textContent: column.title, scope: 'col', className: column.number ? 'number' : ''}));
    table.append(make('thead', {}, make('tr', {}, ...cells)), make('tbody'));
  }
  const body = table.tBodies[0];
  const wanted = Math.max(rows.length, 1);
  while (body.rows.length > wanted) body.deleteRow(-1);
  while (body.rows.length < wanted) body.append(make('tr'));
  if (rows.length === 0) {
    const row = body.rows[0];
    row.className = '';
    row.removeAttribute('tabindex');
    if (row.cells.length !== 1) row.replaceChildren(make('td', {className: 'empty', colSpan: columns.length}));
    set_text(row.cells[0], options.empty);
    row.onclick = row.onkeydown = null;
    return;
  }
  rows.forEach((what, place) => {
    const row = body.rows[place];
    if (row.cells.length !== columns.length || row.cells[0].colSpan > 1) {
      row.replaceChildren(...columns.map((column) => make('td', {className: column.number ? 'number' : column.words ? 'words' : ''})));
    }
    columns.forEach((column, i) => {
      set_text(row.cells[i], column.text(what));
      row.cells[i].classList.toggle('bad', Boolean(column.bad && column.bad(what)));
    });
    if (!options.choose) return;
    row.tabIndex = 0;
    row.className = options.chosen && options.chosen(what) ? 'choice chosen' : 'choice';
    row.onclick = () => options.choose(what);
    row.onkeydown = (event) => {
      if (event.key === 'Enter' || event.key === ' ') {
        event.preventDefault();
        options.choose(what);
      }
      if (event.key === 'ArrowDown' && row.nextElementSibling) row.nextElementSibling.focus();
      if (event.key === 'ArrowUp' && row.previousElementSibling) row.previousElementSibling.focus();
    };
  });
}

/** Names and numbers of a list of definitions. */
export function fill_list(list, entries) {
  while (list.children.length > entries.length) list.lastChild.remove();
  while (list.children.length < entries.length) list.append(make('div', {}, make('dt'), make('dd')));
  entries.forEach(([name, text], place) => {
    set_text(list.children[place].children[0], name);
    set_text(list.children[place].children[1], text);
  });
}
