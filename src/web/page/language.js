// The language of the page, from the one table of words.
import {words as texts} from './configuration_words.js';
import {words as day} from './day_words.js';
import {words as findings} from './finding_words.js';
import {words as others} from './words.js';

const words = {...others, ...findings, ...day, ...texts};

export const languages = [['en', 'English'], ['de', 'Deutsch'], ['ko', '한국어'], ['ja', '日本語']];
const column = Object.fromEntries(languages.map(([name], index) => [name, index]));

function first() {
    const wanted = [stored('language'), ...navigator.languages.map((name) => name.slice(0, 2))];
    return wanted.find((name) => name in column) ?? 'en';
}

/** What this browser remembers; null where it may not remember anything. */
export function stored(name) {
    try { return localStorage.getItem('panelgate.' + name); } catch { return null; }
}

export function store(name, value) {
    try { localStorage.setItem('panelgate.' + name, value); } catch { /* private window */ }
}

export const language = first();
document.documentElement.lang = language;

/** The words of a key; {name} stands for a value. A key that nobody has is shown as it is. */
export function t(key, values = {}) {
    const all = words[key];
    const text = all ? all[column[language]] : key;
    return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

/** Has the table this key? */
export const said = (key) => key in words;

/** The words for one of the gateway's own ("online"); its own where the table has none. */
export function word(kind, name) {
    const key = `${kind}.${name}`;
    return key in words ? t(key) : String(name);
}

const formats = new Map();

/** A number with at most so many digits behind the point. */
export function number(value, digits = 0) {
    if (!formats.has(digits)) {
        formats.set(digits, new Intl.NumberFormat(language, {maximumFractionDigits: digits}));
    }
    return formats.get(digits).format(value);
}

const sign = (1.5).toLocaleString(language).charAt(1);  // before a fraction
const SPOKEN = /^[-+]?\d+(\.\d+)?(e[-+]?\d+)?$/i;

/** A value with all its digits, as decimalOf() reads it: no mark between thousands. */
export const decimalText = (value) => String(value).replace('.', sign);

/** A typed number as JSON has it; null for what is none, or may be two. */
export function decimalOf(typed) {
    const plain = typed.normalize('NFKC').trim().replace('\u2212', '-');
    const digits = plain.replace(sign, '.');
    if (!SPOKEN.test(digits) || (sign !== '.' && plain.includes('.'))) return null;
    return digits.replace('+', '').replace(/^(-?)0+(?=\d)/, '$1');
}

const withUnit = (value, unit) => `${value}\u00a0${unit}`;  // no line ends between them

/** Milliseconds as people say them: "6.8 ms", "12 s", "3 min". */
export function duration(ms) {
    if (ms === null || ms === undefined) return '–';
    if (ms < 10) return withUnit(number(ms, 1), 'ms');
    if (ms < 1000) return withUnit(number(ms), 'ms');
    if (ms < 10000) return withUnit(number(ms / 1000, 1), 's');
    if (ms < 120000) return withUnit(number(ms / 1000), 's');
    if (ms < 7200000) return withUnit(number(ms / 60000), 'min');
    return withUnit(number(ms / 3600000), 'h');
}

const clock = new Intl.DateTimeFormat('en-GB', {hour: '2-digit', minute: '2-digit', second: '2-digit'});
const calendar = new Intl.DateTimeFormat('sv-SE');  // 2026-11-29

/** All times are of this zone: "UTC+9". */
export const zone = new Intl.DateTimeFormat('en', {timeZoneName: 'shortOffset'}).formatToParts()
    .find((part) => part.type === 'timeZoneName').value.replace(/GMT(\+0$)?/, 'UTC');

/** "19:04:05", the same in all languages; with its date where that is not today's. */
export function clockTime(date) {
    const day = calendar.format(date);
    return day === calendar.format() ? clock.format(date) : `${day} ${clock.format(date)}`;
}

/** Wall time of seconds since 1970, with milliseconds. */
export function time(seconds) {
    const ms = Math.floor((seconds * 1000) % 1000);
    return `${clockTime(seconds * 1000)}.${String(ms).padStart(3, '0')}`;
}
