// Points with their age, quality and plot.
import {get, mayWrite, path} from './api.js';
import {attribute, h, list, table, text} from './dom.js';
import {clockTime, duration, t, word} from './language.js';
import {live} from './live.js';
import {plot, sparkline} from './plot.js';
import {enterPoint} from './point_entry.js';
import {historyOf, keyOf, recall, remember, rememberGap, shownValue} from './point_values.js';

const ASK = 2000;        // ms between two rounds of all stations
const PACE = 40;         // ms between two stations
const SHOWN = 200;       // rows
const FILTERED = 12;     // points that nobody needs a filter for

const TONES = {good: 'good', stale: 'warn', bad: 'bad'};

/** A point as it is known now: nobody knows whether a value still holds once the gateway is silent. */
function known(point) {
    const old = live.old && point.quality === 'good';
    return {quality: old ? 'stale' : point.quality, age: point.age_ms === null ? null : point.age_ms + Math.max(0, Date.now() - point.heard)};
}

/** An age, with the instant where that is no longer now. */
const since = (age, quality) => age === null || quality === 'good' ? duration(age) : `${duration(age)} (${clockTime(Date.now() - age)})`;

function row(station, first, pick) {
    const key = keyOf(station, first.name);
    const value = h('td', {class: 'number strong'});
    const quality = h('span');
    const age = h('td', {class: 'number'});
    const spark = sparkline();
    let last = first;
    const write = first.writable && mayWrite() ? h('button', {type: 'button', onclick: () => enterPoint(station, () => last)}, t('write')) : null;
    const node = h('tr', {'data-point': key}, h('td', null, h('button', {type: 'button', class: 'link', onclick: () => pick(station, first)}, key)), value,
        h('td', null, quality), age, h('td', null, spark.node), h('td', null, h('code', null, first.at), ` ${first.type}`), h('td', null, write));
    return {node, update: (point) => {
        last = point;
        const now = known(point);
        text(value, shownValue(point));
        attribute(value, 'class', `number strong${now.quality === 'good' ? '' : ' muted'}`);
        attribute(quality, 'class', `badge ${TONES[now.quality]}`);
        text(quality, word('quality', now.quality));
        text(age, since(now.age, now.quality));
        spark.update(historyOf(key).slice(-120).map(([, one]) => one), {least: Infinity});
    }};
}

class Points {
    #points = new Map();   // key -> {station, ...point}
    #asked = -Infinity;
    #asking = false;
    #told = false;         // the gateway has said which there are
    #plot = null;
    #ended = false;

    constructor(stations) {
        this.stations = stations;
        this.table = table(t('nav.points'), [[t('point')], [t('value'), 'number'], [t('quality')], [t('age'), 'number'], [t('trend')], [t('at')], ['']]);
        this.place = h('div');
        this.none = h('p', {class: 'empty', hidden: true}, t('no.points'));
        this.filter = h('input', {type: 'search', hidden: true, placeholder: t('filter'), 'aria-label': t('filter'), oninput: () => this.#show()});
        this.more = h('p', {class: 'muted'});
        this.node = h('div', null, this.place, h('div', {class: 'bar'}, this.filter), this.table.node, this.more, this.none);
        this.told = ({detail}) => this.#take(detail.station, detail);
        live.addEventListener('point', this.told);
    }

    #take(station, point) {
        if (!this.stations.includes(station)) return;
        const key = keyOf(station, point.name);
        const before = this.#points.get(key);
        if (!before && point.at === undefined) return;  // an event before the first list
        this.#points.set(key, {...before, ...point, station, heard: Date.now()});
        if (point.quality === 'good') remember(key, point.value, Date.now() - (point.age_ms ?? 0));
        else rememberGap(key);
    }

    /** All points of all stations now and then; in between events tell. */
    async #ask() {
        if (this.#asking || performance.now() - this.#asked < ASK) return;
        this.#asking = true;
        for (const station of this.stations) {
            if (this.#ended) return;
            try {
                const {points} = await get(path('stations', station, 'points'));
                for (const point of points) this.#take(station, point);
            } catch {
                for (const point of this.#points.values()) if (point.station === station && point.quality === 'good') point.quality = 'stale';
            }
            if (this.stations.length > 1) await new Promise((resolve) => { setTimeout(resolve, PACE); });
        }
        this.#asked = performance.now();
        this.#asking = false;
        this.#told = true;
        if (!this.#ended) this.#show();
    }

    #pick(station, point) {
        this.#plot?.stop();
        const key = keyOf(station, point.name);
        const read = () => ({rows: historyOf(key)});
        this.#plot = plot({title: key, unit: word('unit', point.unit), labels: [point.name], colours: ['c0'], steps: point.type === 'bool', read, now: Date.now});
        this.place.replaceChildren(h('section', {class: 'card'}, this.#plot.node));
        this.#plot.update();
        recall(station, point.name).then(() => this.#plot.update());
    }

    #show() {
        const wanted = this.filter.value.trim().toLowerCase();
        const all = [...this.#points.entries()].filter(([key]) => key.toLowerCase().includes(wanted)).map(([, point]) => point);
        list(this.table.body, all.slice(0, SHOWN), (point) => keyOf(point.station, point.name),
            (point) => row(point.station, point, (station, one) => this.#pick(station, one)));
        text(this.more, all.length > SHOWN ? t('more', {count: all.length - SHOWN}) : '');
        this.filter.hidden = this.#points.size <= FILTERED;
        this.none.hidden = this.#points.size > 0 || !this.#told;
        this.table.node.hidden = this.#points.size === 0;
        this.#plot?.update();
    }

    update() {
        this.#ask();
        this.#show();
    }
    stop() {
        this.#ended = true;
        this.#plot?.stop();
        live.removeEventListener('point', this.told);
    }
}

/** The points of some stations: {node, update, stop}. */
export function pointsTable(stations) { return new Points(stations); }

export function pointsView() {
    const points = pointsTable(live.stations.map((station) => station.name));
    return {node: h('div', null, h('h1', null, t('nav.points')), points.node), update: () => points.update(), stop: () => points.stop()};
}
