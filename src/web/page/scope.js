// The bus scope: what was on a line's wire when.
import {offers, path} from './api.js';
import {attribute, choice, h, list, table, text} from './dom.js';
import {download} from './download.js';
import {showFrame} from './frame_view.js';
import {incidents} from './incidents.js';
import {duration, t, time, word, zone} from './language.js';
import {live} from './live.js';
import {ScopeCanvas, colours} from './scope_canvas.js';
import {traceOf} from './trace.js';

const SHORTEST = 0.005;  // seconds on the canvas
const LONGEST = 120;
const CLOSE = 0.1;       // around one frame
const LISTED = 40;       // frames and decisions below it

class Scope {
    #span = 1;        // seconds on the canvas
    #end = null;      // of what is shown, when it stands; null: it follows the line
    #selected = null;
    #drawn = false;
    #drag = null;
    #pointers = new Map();  // that are down, by id: x
    #wanted;

    /** `wanted`: which frame to begin with, when the line's trace still has it. */
    constructor(line, wanted) {
        this.line = line;
        this.#wanted = wanted;
        this.trace = traceOf(line);
        this.canvas = h('canvas', {class: 'scope', tabindex: 0, role: 'img', 'aria-describedby': 'scope-keys',
            onwheel: (e) => this.#wheel(e), onkeydown: (e) => this.#key(e), onpointerdown: (e) => this.#down(e),
            onpointermove: (e) => this.#move(e), onpointerup: (e) => this.#up(e), onpointercancel: (e) => { this.#pointers.delete(e.pointerId); this.#drag = null; }});
        this.drawing = new ScopeCanvas(this.canvas);
        this.drawing.decisionsName = t('decisions');
        this.pause = h('button', {type: 'button', class: 'primary', onclick: () => this.#stand(this.#end === null)});
        this.window = h('output', {class: 'figure'});
        this.summary = h('p', {class: 'muted', 'aria-live': 'off'});
        this.detail = h('section', {class: 'card detail', 'aria-live': 'polite', 'aria-label': t('frame')}, h('p', {class: 'muted'}, t('scope.pick')));
        this.incidents = incidents(line);
        this.table = table(t('frames'), [[`${t('time')} (${zone})`], [t('station')], [t('kind')], [t('bytes')]]);
        this.node = h('div', null, this.#controls(), h('div', {class: 'card flush'}, this.canvas),
            h('p', {id: 'scope-keys', class: 'unseen'}, t('scope.keys')), legend(), this.summary, this.detail,
            h('h2', null, t('frames')), this.table.node, this.incidents.node);
        this.#stand(false);
        this.unwatch = this.trace.watch(() => {
            if (this.trace.refusal) text(this.summary, this.trace.refusal);
            this.#seek();
            this.#soon();
        });
        this.#seek();
        this.resized = new ResizeObserver(() => this.#soon());
        this.resized.observe(this.canvas);
    }

    stop() {
        this.unwatch();
        this.incidents.stop();
        this.resized.disconnect();
    }

    #controls() {
        const button = (label, name, action) =>
            h('button', {type: 'button', 'aria-label': name, title: name, onclick: action}, label);
        const exports = [download(path('lines', this.line, 'trace') + '?last=500', `${this.line}.json`, 'JSON', {class: 'button'})];
        if (offers('GET /api/v1/lines/{}/trace.pcapng')) {
            exports.unshift(download(path('lines', this.line, 'trace.pcapng'), `${this.line}.pcapng`, t('export'), {class: 'button'}));
        }
        return h('div', {class: 'bar'}, this.pause, button('◀', t('earlier'), () => this.#pan(-0.3)),
            button('▶', t('later'), () => this.#pan(0.3)), button('−', t('zoom.out'), () => this.#zoom(2)),
            button('+', t('zoom.in'), () => this.#zoom(0.5)), this.window, h('span', {class: 'grow'}), exports);
    }

    #seek() {
        const frame = this.#wanted && this.trace.timeline.segments.find(this.#wanted);
        if (!frame) return;
        this.#wanted = null;
        this.#span = CLOSE;
        this.#pick(frame);
        this.#to(frame.to + CLOSE / 2);
    }

    #stand(still) {
        this.#end = still ? this.trace.timeline.end : null;
        text(this.pause, still ? t('follow') : t('pause'));
        attribute(this.pause, 'aria-pressed', String(still));
        this.#soon();
    }

    get #shownEnd() { return this.#end ?? this.trace.timeline.end; }

    #pan(share) { this.#to(this.#shownEnd + share * this.#span); }
    #to(end) {
        if (this.#end === null) this.#stand(true);
        const {begin, end: last} = this.trace.timeline;
        this.#end = Math.max(begin + this.#span / 2, Math.min(end, last + this.#span / 2));
        this.#soon();
    }
    /** Around an instant that stays where it is; without one at the right edge. */
    #zoom(factor, around = this.#shownEnd) {
        const span = Math.max(SHORTEST, Math.min(LONGEST, this.#span * factor));
        const end = around + (this.#shownEnd - around) * span / this.#span;
        this.#span = span;
        if (this.#end === null) this.#soon();
        else this.#to(end);
    }

    #wheel(event) {
        event.preventDefault();
        if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
            return this.#pan((event.deltaX || event.deltaY) / 600);
        }
        return this.#zoom(Math.exp(event.deltaY / 400), this.#end === null ? undefined : this.drawing.instant(event.offsetX));
    }
    #key(event) {
        const step = {ArrowLeft: () => this.#pan(-0.2), ArrowRight: () => this.#pan(0.2), '+': () => this.#zoom(0.5),
            '-': () => this.#zoom(2), ' ': () => this.#stand(this.#end === null), End: () => this.#stand(false),
            Home: () => this.#to(this.trace.timeline.begin + this.#span), '.': () => this.#step(1), ',': () => this.#step(-1)}[event.key];
        if (!step || event.ctrlKey || event.metaKey) return;
        event.preventDefault();
        step();
    }
    /** To the frame beside the one that is explained. */
    #step(by) {
        const {segments} = this.trace.timeline;
        const now = segments.findIndex((frame) => frame.sequence === this.#selected);
        const frame = segments[now < 0 ? segments.length - 1 : Math.max(0, Math.min(segments.length - 1, now + by))];
        if (!frame) return;
        this.select(frame);
        if (frame.to > this.#shownEnd || frame.from < this.#shownEnd - this.#span) this.#to(frame.to + this.#span / 2);
    }

    #down(event) {
        this.canvas.setPointerCapture(event.pointerId);
        this.#pointers.set(event.pointerId, event.offsetX);
        this.#drag = {x: event.offsetX, end: this.#shownEnd, moved: false};
    }
    #move(event) {
        if (this.#pointers.size === 2 && this.#pointers.has(event.pointerId)) return this.#pinch(event);
        if (this.#drag) {
            const by = event.offsetX - this.#drag.x;
            if (Math.abs(by) > 4) this.#drag.moved = true;
            if (this.#drag.moved) this.#to(this.#drag.end - by * this.drawing.grain);
            return null;
        }
        const frame = event.pointerType === 'mouse' ? this.drawing.at(event.offsetX, event.offsetY) : null;
        this.canvas.classList.toggle('over', frame !== null);
        if (frame && frame.sequence !== this.#selected) this.select(frame);
        return null;
    }
    /** Two fingers: what is between them stays between them. */
    #pinch(event) {
        const apart = () => Math.max(20, Math.abs([...this.#pointers.values()].reduce((a, b) => a - b)));
        const before = apart();
        this.#pointers.set(event.pointerId, event.offsetX);
        const middle = [...this.#pointers.values()].reduce((a, b) => a + b) / 2;
        this.#drag.moved = true;
        this.#drag = {...this.#drag, x: event.offsetX, end: this.#shownEnd};
        this.#zoom(before / apart(), this.drawing.instant(middle));
    }
    #up(event) {
        this.#pointers.delete(event.pointerId);
        const frame = this.#drag?.moved ? null : this.drawing.at(event.offsetX, event.offsetY);
        this.#drag = null;
        if (frame) this.#pick(frame);
    }
    /** What somebody looks at does not move away. */
    #pick(frame) {
        if (this.#end === null) this.#stand(true);
        this.select(frame);
    }

    select(frame) {
        this.#selected = frame.sequence;
        const known = live.at(this.line, frame.station);
        const place = h('div');
        const said = frame.text ?? frame.why;
        this.detail.replaceChildren(h('h2', null, `#${frame.sequence} ${known?.name ?? frame.station ?? ''}`),
            h('p', {class: 'muted'}, [time(frame.wall), frame.data && word('kind', frame.note)].filter(Boolean).join(' · '),
                said ? h('span', {lang: 'en'}, ` · ${said}`) : null), this.#took(frame), place);
        if (frame.data) showFrame(place, frame, known?.name);
        this.#soon();
    }

    /** Where the time of this frame's exchange went. */
    #took(frame) {
        const exchange = this.trace.timeline.exchanges.findLast((one) => one.request === frame || one.reply === frame);
        if (!exchange) return null;
        const parts = ['queue', 'wire', 'think'].filter((part) => typeof exchange[part] === 'number');
        return h('p', null, parts.map((part) => `${t(part)} ${duration(exchange[part])}`).join(' · '), exchange.client ? ` · ${exchange.client}` : '');
    }

    #rows(seen) {
        const listed = live.stations.filter((station) => station.line === this.line);
        const ids = new Set(listed.map((station) => station.id));
        for (const frame of seen) if (frame.station !== null) ids.add(frame.station);
        return [...ids].sort((a, b) => a - b).map((station, index) => ({station, colour: index % colours,
            name: live.at(this.line, station)?.name ?? (station === 0 ? t('broadcast') : String(station))}));
    }

    #soon() {
        if (this.#drawn) return;
        this.#drawn = true;
        requestAnimationFrame(() => {
            this.#drawn = false;
            if (this.canvas.isConnected) this.#draw();
        });
    }

    #draw() {
        const {timeline} = this.trace;
        const to = this.#shownEnd;
        const from = to - this.#span;
        const rows = this.#rows(timeline.seen(from, to));
        if (rows.length === 0) return;
        const seen = this.drawing.draw({timeline, from, to, rows, selected: this.#selected});
        text(this.window, duration(this.#span * 1000));
        const bad = seen.filter((frame) => frame.direction === 'discarded').length;
        text(this.summary, t('scope.summary', {frames: seen.length, bad, window: duration(this.#span * 1000)}));
        attribute(this.canvas, 'aria-label', `${t('nav.scope')} ${this.line}: ${this.summary.textContent}`);
        Object.assign(this.canvas.dataset, {frames: seen.length, first: seen[0]?.sequence ?? '', last: seen.at(-1)?.sequence ?? ''});
        const told = timeline.decisions.filter((one) => one.at >= from && one.at <= to);
        this.#list([...seen, ...told].sort((a, b) => b.sequence - a.sequence).slice(0, LISTED));
    }

    #list(entries) {
        list(this.table.body, entries, (entry) => entry.sequence, (entry) => ({node: h('tr', {class: entry.direction ?? 'decision'},
            h('td', {class: 'figure'}, time(entry.wall)),
            h('td', null, live.at(this.line, entry.station)?.name ?? String(entry.station ?? '')),
            h('td', null, entry.data ? word('kind', entry.note) : t('key.decision')),
            h('td', {lang: 'en'}, entry.data ? h('button', {type: 'button', class: 'link mono', onclick: () => this.#pick(entry)}, entry.bytes) : entry.text))}));
    }
}

function legend() {
    const key = (kind) => h('li', null, h('span', {class: `key ${kind}`, 'aria-hidden': 'true'}), t('key.' + kind));
    return h('ul', {class: 'legend'}, ['sent', 'received', 'think', 'gap', 'silence', 'rest', 'discarded', 'decision'].map(key));
}

/** The view: {node, stop}. `argument`: a line, or nothing for the first; `detail`: a frame's number, or a
 *  transaction's ("t17"). */
export function scopeView({argument, detail}) {
    const name = argument ?? live.lines[0]?.name;
    if (!live.line(name)) return {node: h('p', {class: 'empty'}, t('no.lines'))};
    const number = Number(detail?.replace('t', ''));
    const wanted = detail?.startsWith('t') ? (one) => one.transaction === number : (one) => one.sequence === number;
    const scope = new Scope(name, detail === undefined ? null : wanted);
    const chooser = live.lines.length < 2 ? null : h('p', {class: 'bar'}, t('line'),
        choice(t('line'), live.lines.map((line) => [line.name, line.name]), name, (chosen) => { location.hash = `#/scope/${chosen}`; }));
    return {node: h('div', null, h('h1', null, t('nav.scope'), ' ', h('small', null, name)), chooser, scope.node), stop: () => scope.stop()};
}
