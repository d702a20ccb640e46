// One station: how it does, what was found, how long it takes, its points and what to do with it.
import {get, path} from './api.js';
import {h, list, replace, text} from './dom.js';
import {findingNote} from './finding.js';
import {duration, number, t, word} from './language.js';
import {PARTS, latencyBars} from './latency.js';
import {badge, linesWithFindings} from './overview.js';
import {pointsTable} from './points.js';
import {simulator} from './simulator.js';
import {latency, plotted} from './timeline.js';
import {traceOf} from './trace.js';
import {live} from './live.js';

const ASK = 2000;  // ms between two looks at the polled blocks

function facts(station) {
    const rows = [[t('line'), `${station.line}:${station.id}`], [t('profile'), station.profile ?? t('no.profile')],
        [t('unit'), station.unit ?? '–'], [t('access'), word('access', station.read_only ? 'read_only' : 'read_write')],
        [t('last'), duration(live.ago(station.last_success_ms))],
        [t('condition'), station.condition && station.state !== 'line_down' ? word('condition', station.condition) : '–']];
    return rows.map(([name, value]) => h('div', null, h('dt', null, name), h('dd', null, String(value))));
}

function latencyPlot(station) {
    const trace = traceOf(station.line);
    const read = () => plotted(trace.timeline.of(station.id), trace.timeline.waiting);
    const made = latencyBars(t('nav.latency'), read);
    return {...made, watch: (changed) => trace.watch(() => { made.update(); changed(); })};
}

function polls(body) {
    if (!body.polls?.length) return null;
    return h('section', {class: 'card'}, h('h2', null, t('polls')), h('ul', {class: 'plain'}, body.polls.map((poll) =>
        h('li', null, h('code', null, `${poll.read} ×${poll.count}`), ` ${duration(poll.every_ms)} `,
            h('span', {class: `badge ${poll.quality === 'good' ? 'good' : 'bad'}`}, word('quality', poll.quality)),
            ` ${number(poll.good)} / ${number(poll.failed)} ${t('failed')}`))));
}

export function stationView({argument}) {
    const first = live.station(argument);
    if (!first) return {node: h('p', {class: 'empty'}, t('no.station', {name: argument ?? ''}))};
    const state = badge();
    const list_ = h('dl', {class: 'facts'});
    const findings = h('ul', {class: 'findings'});
    const figures = h('p', {class: 'muted'});
    const polled = h('div');
    const points = pointsTable([first.name]);
    const faults = simulator(first.name);
    const graph = latencyPlot(first);
    const node = h('div', null, h('h1', null, first.name, ' ', state.node),
        h('div', {class: 'columns'}, h('section', {class: 'card'}, h('h2', null, t('station')), list_, findings,
            h('p', null, h('a', {class: 'button', href: `#/request/${encodeURIComponent(first.name)}`}, t('nav.request')), ' ',
                h('a', {class: 'button', href: `#/scope/${first.line}`}, t('nav.scope')))),
        h('section', {class: 'card'}, graph.node, figures)),
        h('h2', null, t('nav.points')), points.node, polled, faults.node);
    let asked = -Infinity;
    const look = () => {
        if (performance.now() - asked < ASK) return;
        asked = performance.now();
        get(path('stations', first.name)).then((body) => replace(polled, polls(body)), () => {});
    };
    const update = () => {
        look();
        const station = live.station(first.name);
        if (!station) return;
        state.update(station.state);
        replace(list_, facts(station));
        const known = linesWithFindings(() => {}).find((line) => line.name === station.line)?.told ?? [];
        list(findings, known.filter((one) => one.station === station.id), (one) => one.cause + one.text, (one) => ({node: findingNote(one)}));
        const all = latency(traceOf(station.line).timeline.of(station.id));
        text(figures, t('latency.figures', {count: all.count, failed: all.count - all.answered, high: duration(all.total.high),
            parts: PARTS.map((part) => `${t(part)} ${duration(all[part].mean)}`).join(', ')}));
        points.update();
    };
    const end = graph.watch(update);
    return {node, update, stop: () => { end(); graph.stop(); points.stop(); }};
}
