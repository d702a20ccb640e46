// The faults of a simulated panel, to see what the gateway makes of them.
import {get, maySimulate, path, put} from './api.js';
import {h, replace} from './dom.js';
import {t, word} from './language.js';
import {live} from './live.js';

const SHOWN = ['dead', 'drop', 'damage', 'late', 'truncate', 'foreign_id', 'duplicate'];

/** Buttons for a station of a simulated line; nothing for a real one. */
export function simulator(station) {
    const node = h('div');
    if (live.line(live.station(station)?.line)?.device !== 'sim' || !maySimulate()) return {node};
    const show = (body) => replace(node, h('section', {class: 'card'}, h('h2', null, t('simulator')),
        h('p', {class: 'muted'}, t('simulator.hint')), h('div', {class: 'bar'}, SHOWN.filter((name) => name in body.faults).map((name) =>
            h('button', {type: 'button', 'aria-pressed': String(body.faults[name] > 0), onclick: () => change(body, name)}, word('fault', name))))));
    const change = (body, name) => put(path('simulator', station), {...body.faults, [name]: body.faults[name] > 0 ? 0 : 1}).then(show, () => {});
    get(path('simulator', station)).then(show, () => {});
    return {node};
}
