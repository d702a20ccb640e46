// What this page knows of points: their last values, and how a value is said.
import {get, offers, path} from './api.js';
import {decimalText, t, word} from './language.js';
import {live} from './live.js';

const MANY = 200;        // points, of which fewer values are remembered each
const kept = () => histories.size > MANY ? 120 : 3600;  // values of a point
const histories = new Map();  // "press/temperature" -> [[ms since 1970, number, or null: unknown from here on]]

export const keyOf = (station, name) => `${station}/${name}`;

/** What is kept of a point: [[ms since 1970, number or null]], the oldest first; null: a gap begins. */
export const historyOf = (key) => histories.get(key) ?? [];

export function remember(key, value, at = Date.now()) {
    if (typeof value === 'boolean') value = value ? 1 : 0;
    if (typeof value !== 'number') return;
    if (!histories.has(key)) histories.set(key, []);
    const values = histories.get(key);
    if (values.length > 0 && at <= values.at(-1)[0]) return;
    values.push([at, value]);
    while (values.length > kept()) values.shift();
}

/** From here on nobody knows the value. */
export function rememberGap(key, at = Date.now()) {
    const values = histories.get(key);
    if (values && values.at(-1)[1] !== null && at > values.at(-1)[0]) values.push([at, null]);
}

live.addEventListener('point', ({detail}) => {
    const key = keyOf(detail.station, detail.name);
    if (detail.quality === 'good') remember(key, detail.value, Date.now() - (detail.age_ms ?? 0));
    else rememberGap(key);
});
live.addEventListener('rest', () => { for (const key of histories.keys()) rememberGap(key); });

/** As it is typed, too. */
export function shownValue({value, label, unit}) {
    if (value === null || value === undefined) return '–';
    const said = typeof value === 'number' ? decimalText(value) : typeof value === 'boolean' ? t(value ? 'on' : 'off') : value;
    return [label ? `${label} (${said})` : said, unit ? word('unit', unit) : ''].filter(Boolean).join('\u00a0');
}

/** What the gateway remembers comes before what this page has seen. */
export async function recall(station, name) {
    if (!offers('GET /api/v1/stations/{}/points/{}/history')) return;
    const key = keyOf(station, name);
    try {
        const {samples} = await get(path('stations', station, 'points', name, 'history'));
        const seen = histories.get(key) ?? [];
        const from = seen[0]?.[0] ?? Infinity;
        const before = samples.map((one) => [Date.parse(one.time), one.value === null ? null : Number(one.value)]).filter(([at]) => at < from);
        histories.set(key, [...before, ...seen].slice(-kept()));
    } catch { /* the plot begins now */ }
}
