// Shows a frame byte by byte: the bytes as blocks, and what each means, with the panel's notation.
import {get, offers, path} from './api.js';
import {h} from './dom.js';
import {explain, hex} from './frame.js';
import {exceptionPage, explained} from './help.js';
import {t} from './language.js';

const REMEMBERED = 2000;
const known = new Map();  // "press/coils/288/3" -> promise of its notations

/** The panel's own names of these items: one each, or [] where it has none. Costs no time on the line. */
export function notations(station, table, address, count) {
    if (!station || table === null || address === null || !offers('GET /api/v1/stations/{}/{}/{}/plan')) {
        return Promise.resolve([]);
    }
    const key = [station, table, address, count].join('/');
    if (!known.has(key)) {
        if (known.size >= REMEMBERED) known.clear();
        known.set(key, get(path('stations', station, table, String(address), 'plan') + `?count=${Math.max(1, count)}`)
            .then((plan) => plan.notations, () => []));
    }
    return known.get(key);
}

function exception(code) {
    const known = t('exception.' + code).replace(/^exception\.\d+$/, String(code));
    return [known, ' ', explained(exceptionPage(code), known)];
}

function value(field, found, names) {
    if (field.kind === 'function') return t('fn.' + (field.value & 0x7F)).replace(/^fn\.\d+$/, '');
    if (field.kind === 'exception') return exception(field.value);
    if (field.kind === 'address' && names[0]) return `${field.value} → ${names[0]}`;
    if (field.kind === 'station' && field.value === 0) return t('broadcast');
    if (field.kind === 'values') return found.values.map((one, i) => names[i] ? `${names[i]} = ${one}` : one).join('  ');
    return field.value === null ? '' : String(field.value);
}

/** `found` is what explain() gave. */
export function frameView(found, names = []) {
    const bytes = h('div', {class: 'bytes', 'aria-hidden': 'true'});
    const meanings = h('dl', {class: 'meanings'});
    found.fields.forEach((field, index) => {
        const mark = (on) => () => {
            for (const node of [block, row]) node.classList.toggle('marked', on);
        };
        const listeners = {onpointerenter: mark(true), onpointerleave: mark(false)};
        const block = h('span', {class: `byte f${index % 6}`, ...listeners}, hex(field.bytes));
        const row = h('div', listeners,
            h('dt', {class: `f${index % 6}`}, t('field.' + field.kind), h('code', null, hex(field.bytes))),
            h('dd', null, value(field, found, names)));
        bytes.append(block);
        meanings.append(row);
    });
    return h('div', {class: 'frame'}, bytes, meanings);
}

/** A frame of a timeline, explained into a place on the page. */
export async function showFrame(place, frame, station) {
    const request = frame.answers ? explain(frame.answers.data, false) : null;
    const isReply = frame.direction !== 'sent' && frame.note !== 'heard request' && frame.note !== 'foreign request';
    const found = explain(frame.data, isReply, request);
    place.replaceChildren(frameView(found));
    const names = await notations(station, found.table, found.address, found.count);
    if (names.length > 0) place.replaceChildren(frameView(found, names));
}
