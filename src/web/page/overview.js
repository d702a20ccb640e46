// Lines with their load, and their stations as tiles.
import {alarms} from './alarms.js';
import {get, offers, path, seesWhole} from './api.js';
import {attribute, h, list, replace, text} from './dom.js';
import {findingNote, findingText} from './finding.js';
import {clockTime, duration, number, t, word} from './language.js';
import {live} from './live.js';
import {sparkline} from './plot.js';
import {shownValue} from './point_values.js';
import {latency} from './timeline.js';
import {traceOf} from './trace.js';

const TRACED = 6;       // lines whose latencies are followed here
const KEPT = 40;        // transactions of a sparkline
const HISTORY = 120;    // loads of a sparkline
const LOADED = 20;      // % of the wire that a sparkline shows at least
const FINDINGS = 5000;  // ms between two looks at a line's findings

/** How a state looks: 'good', 'warn', 'bad' (nobody answers), 'idle' (nobody has asked, or we do not know). */
export function tone(state) {
    if (['online', 'heard', 'up'].includes(state)) return 'good';
    if (state === 'overload') return 'warn';
    return state === 'unknown' || state === 'old' ? 'idle' : 'bad';
}

/** A state as it is known now: {node, update}. */
export function badge() {
    const node = h('span', {class: 'badge'});
    return {node, update: (state) => {
        const now = live.old ? 'old' : state;
        attribute(node, 'class', `badge ${tone(now)}`);
        text(node, word('state', now));
    }};
}

/** When somebody has answered last, who was heard `ms` before the gateway said so. */
function lastAnswer({state, last_success_ms: ms}) {
    if (ms === null) return '';
    const ago = duration(live.ago(ms));
    return tone(state) === 'good' && !live.old ? t('last.answer', {ago}) : t('last.answer.at', {ago, time: clockTime(live.heard - ms)});
}

/** A point of a tile: {node, update}. What is not good now is grey, with its quality. */
function tileValue(first) {
    const value = h('strong');
    const node = h('span', {class: 'tile-value'}, h('span', {class: 'muted'}, first.name), ' ', value);
    return {node, update: (point) => {
        const quality = live.old && point.quality === 'good' ? 'stale' : point.quality;
        attribute(value, 'class', quality === 'good' ? '' : 'muted');
        text(value, quality === 'good' ? shownValue(point) : `${shownValue(point)} (${word('quality', quality)})`);
    }};
}

/** A station's tile: {node, update}. */
function tile(first) {
    const name = h('span', {class: 'name'}, first.name);
    const state = badge();
    const spark = sparkline();
    const figure = h('span', {class: 'figure'});
    const facts = h('span', {class: 'muted'});
    const finding = h('span', {class: 'tile-finding'});
    const values = h('span', {class: 'tile-values'});
    const node = h('a', {class: 'tile', href: `#/station/${encodeURIComponent(first.name)}`, 'data-station': first.name},
        h('span', {class: 'head'}, name, state.node), h('span', {class: 'muted'}, `${first.line}:${first.id} · ${first.profile ?? t('no.profile')}`),
        values, h('span', {class: 'head'}, spark.node, figure), facts, finding);
    return {node, update: (station) => {
        attribute(node, 'class', `tile ${tone(station.state)} ${station.state}`);
        state.update(station.state);
        const line = live.line(station.line);
        const {timeline} = traceOf(station.line);
        const over = timeline.of(station.id).slice(-KEPT).filter((one) => one !== timeline.waiting);
        spark.update(over.map((one) => one.total), {ticked: true});
        const mean = tone(station.state) === 'bad' || live.old ? null : latency(timeline.of(station.id)).think.mean;
        text(figure, mean === null ? '–' : `${t('think')} ${duration(mean)}`);
        list(values, station.overview ?? [], (point) => point.name, tileValue);
        text(facts, lastAnswer(station));
        const told = line?.told?.find((one) => one.station === station.id);
        text(finding, told ? findingText(told).text : '');
    }};
}

/** What the gateway remembers of a line's load comes before what this page sees. */
async function recall(line, history) {
    if (!offers('GET /api/v1/lines/{}/history') || !seesWhole(line)) return;
    try {
        const {samples} = await get(path('lines', line, 'history'));
        history.unshift(...samples.map((one) => one.load_percent).filter((load) => load !== null).slice(-HISTORY));
    } catch { /* it begins now */ }
}

const showFindings = (place, told) => list(place, told, (one) => `${one.cause} ${one.station} ${one.text}`, (one) => ({node: findingNote(one)}));

/** The worst first (`rank` 0), each rank in the order of the file. */
const worstFirst = (all, rank) => [...all].sort((one, other) => rank(one) - rank(other));
const rankOfLine = (line) => line.up ? line.findings.length > 0 || live.findings.some((one) => one.line === line.name) ? 1 : 2 : 0;
const rankOfStation = (station) => tone(station.state) === 'bad' ? 0 : 1;

/** A line's card with its tiles: {node, update}. */
function card(first) {
    const meter = h('meter', {min: 0, max: 100, high: 80, optimum: 0, 'aria-label': t('load.of', {line: first.name})});
    const load = h('span', {class: 'figure'});
    const state = badge();
    const why = h('p', {class: 'refusal', lang: 'en'});
    const facts = h('p', {class: 'muted'});
    const spark = sparkline();
    const history = [];
    recall(first.name, history);
    const findings = h('ul', {class: 'findings'});
    const tiles = h('div', {class: 'tiles'});
    const node = h('section', {class: 'line', 'aria-label': `${t('line')} ${first.name}`},
        h('div', {class: 'card'},
            h('div', {class: 'head'}, h('h2', null, first.name), state.node, h('span', {class: 'grow'}),
                h('a', {href: `#/scope/${first.name}`}, t('nav.scope')), h('a', {href: `#/latency/${first.name}`}, t('nav.latency'))),
            h('div', {class: 'load'}, meter, load, spark.node), why, facts, findings),
        tiles);
    return {node, update: (line) => {
        const found = [...line.told ?? [], ...live.findings.filter((one) => one.line === line.name)];
        state.update(!line.up ? 'line_down' : found.some((one) => one.cause === 'overload') ? 'overload' : 'up');
        text(why, line.up ? '' : line.state);
        why.hidden = line.up;
        meter.value = line.load_percent;
        text(load, t('load', {percent: number(line.load_percent, 1)}));
        history.push(line.load_percent);
        if (history.length > HISTORY) history.shift();
        spark.update(history, {most: LOADED});
        text(facts, [line.device, line.mode === 'listen' ? t('listens') : null, t('waiting', {count: line.queue_depth})].filter(Boolean).join(' · '));
        showFindings(findings, found);
        list(tiles, worstFirst(live.stations.filter((station) => station.line === line.name), rankOfStation), (station) => station.name, tile);
    }};
}

const told = new Map();  // line -> {at, findings}

/** A line's findings with their advice; asked for where the list of lines says that there are any. */
async function findingsOf(line) {
    if (line.findings.length === 0) return told.delete(line.name);
    const before = told.get(line.name);
    if (before && performance.now() - before.at < FINDINGS && before.count === line.findings.length) return false;
    told.set(line.name, {findings: before?.findings ?? [], count: line.findings.length, at: performance.now()});
    try {
        told.get(line.name).findings = (await get(path('lines', line.name))).findings;
    } catch { /* the next look will do */ }
    return true;
}

/** Lines as they are, each with `told`: its findings in words. */
export function linesWithFindings(changed) {
    for (const line of live.lines) findingsOf(line).then((news) => news && changed());
    return live.lines.map((line) => Object.assign(line, {told: told.get(line.name)?.findings ?? []}));
}

/** How many lines are down, and how many stations do not answer. */
export function troubles() {
    return {down: live.lines.filter((line) => !line.up).length, bad: live.stations.filter((station) => tone(station.state) === 'bad').length};
}

/** Is there nothing that anybody should look at, besides states? */
const isWell = () => !live.old && live.lines.length > 0 && live.findings.length + alarms.waiting.length === 0 && live.lines.every((line) => line.findings.length === 0);

export function overviewView() {
    const lines = h('div');
    const counts = h('p', {class: 'counts', role: 'status'});
    const findings = h('ul', {class: 'findings'});
    const own = h('section', {class: 'card', id: 'gateway'}, h('h2', null, t('gateway')), findings);
    const node = h('div', null, h('h1', null, t('nav.overview')), counts, own, lines);
    const update = () => {
        const {down, bad} = troubles();
        const said = [t('counts', {lines: live.lines.length, stations: live.stations.length, bad: live.old ? '?' : bad})];
        if (down > 0) said.push(t('counts.down', {down}));
        if (bad + down === 0 && isWell()) said.push(t('counts.well'));
        if (alarms.waiting.length > 0) said.push(t('counts.alarms', {count: alarms.waiting.length}));
        attribute(counts, 'class', bad + down + alarms.waiting.length > 0 ? 'counts bad' : 'counts');
        text(counts, said.join(' · '));
        const found = live.findings.filter((one) => !one.line);
        showFindings(findings, found);
        own.hidden = found.length === 0;
        list(lines, worstFirst(linesWithFindings(update), rankOfLine), (line) => line.name, card);
        if (live.lines.length === 0) replace(lines, h('p', {class: 'empty'}, t('no.lines')));
    };
    const ends = live.lines.slice(0, TRACED).map((line) => {
        const trace = traceOf(line.name);
        let seen = trace.timeline.end > 0;
        return trace.watch(() => seen || (seen = true, update()));  // from then on with the status
    });
    return {node, update, stop: () => ends.forEach((end) => end())};
}
