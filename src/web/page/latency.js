// Where the time of a request goes: queue, wire, and the panel's own thinking.
import {attribute, choice, h, list, table, text} from './dom.js';
import {duration, number, t} from './language.js';
import {live} from './live.js';
import {plot} from './plot.js';
import {latency, plotted} from './timeline.js';
import {gatewayNow, traceOf} from './trace.js';

const PLOTTED = 600;
/** A request's time: what the queue, the wire and the panel took of it. */
export const PARTS = ['queue', 'wire', 'think'];

/** One station's bar: {node, update}; the widest of all is `most` milliseconds. */
function row(first) {
    const bars = PARTS.map((part) => h('span', {class: `part ${part}`}));
    const bar = h('div', {class: 'stack', role: 'img'}, bars);
    const cells = ['total', ...PARTS].map(() => h('td', {class: 'number'}));
    const high = h('td', {class: 'number'});
    const count = h('td', {class: 'number'});
    const node = h('tr', {'data-station': first.name}, h('th', {scope: 'row'}, h('a', {href: `#/station/${encodeURIComponent(first.name)}`}, first.name)),
        h('td', {class: 'wide'}, bar), cells, high, count);
    return {node, update: ({name, figures, most}) => {
        PARTS.forEach((part, i) => { bars[i].style.width = `${(figures[part].mean ?? 0) / most * 100}%`; });
        attribute(bar, 'aria-label', `${name}: ` + PARTS.map((part) => `${t(part)} ${duration(figures[part].mean)}`).join(', '));
        ['total', ...PARTS].forEach((part, i) => text(cells[i], duration(figures[part].mean)));
        text(high, duration(figures.total.high));
        text(count, `${number(figures.answered)} / ${number(figures.count)}`);
    }};
}

/** A plot of what plotted() gives. */
export function latencyBars(title, read) {
    return plot({title, unit: 'ms', labels: PARTS.map((part) => t(part)), colours: ['c3', 'c0', 'c1'], stacked: true, read, now: gatewayNow});
}

function split(line) {
    const trace = traceOf(line);
    return latencyBars(t('latency.plot', {line}), () => plotted(trace.timeline.exchanges.slice(-PLOTTED), trace.timeline.waiting));
}

export function latencyView({argument}) {
    const line = argument ?? live.lines[0]?.name;
    if (!live.line(line)) return {node: h('p', {class: 'empty'}, t('no.lines'))};
    const numbers = [t('together'), ...PARTS.map((part) => t(part)), '95 %', t('answered')].map((name) => [name, 'number']);
    const shown = table(t('nav.latency'), [[t('station')], [''], ...numbers]);
    const graph = split(line);
    const chooser = live.lines.length < 2 ? null : choice(t('line'), live.lines.map((one) => [one.name, one.name]), line, (chosen) => { location.hash = `#/latency/${chosen}`; });
    const legend = h('ul', {class: 'legend'}, PARTS.map((part) => h('li', null, h('span', {class: `key part ${part}`, 'aria-hidden': 'true'}), t('about.' + part))));
    const node = h('div', null, h('h1', null, t('nav.latency'), ' ', h('small', null, line)), chooser, legend, shown.node, h('section', {class: 'card'}, graph.node));
    const show = () => {
        const {timeline} = traceOf(line);
        const stations = live.stations.filter((station) => station.line === line).map((station) => ({name: station.name,
            figures: latency(timeline.of(station.id))}));
        const most = Math.max(1, ...stations.map(({figures}) => figures.queue.mean + figures.wire.mean + figures.think.mean));
        list(shown.body, stations.map((station) => ({...station, most})), (one) => one.name, row);
    };
    const end = traceOf(line).watch(() => { show(); graph.update(); });
    return {node, update: show, stop: () => { end(); graph.stop(); }};
}
