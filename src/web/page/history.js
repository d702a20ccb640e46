// Values of days: several points in one plot, with least and greatest values as a band.
import {get, path} from './api.js';
import {choice, h, text} from './dom.js';
import {download} from './download.js';
import {clockTime, number, t, word} from './language.js';
import {live} from './live.js';
import {colour, library} from './plot.js';

const HOUR = 3600000;  // ms
const SPANS = [['1', '1 h'], ['8', '8 h'], ['24', '1 d'], ['168', '7 d'], ['720', '30 d']];
const COLOURS = ['c0', 'c1', 'c2', 'c3'];
const MOST = COLOURS.length;  // points of a plot
const STEPS = 500;

/** A multiple of 10 s, so that a span has some 500 steps. */
const stepOf = (span) => Math.max(10, Math.ceil(span / 1000 / STEPS / 10) * 10);

/** Rows of the plot: [Date, [min, mean, max], ...]; a step that a point lacks is a gap. */
function rowsOf(all, step) {
    const times = new Map();
    all.forEach(({samples}, index) => samples.forEach((one) => {
        const at = Date.parse(one.time);
        if (!times.has(at)) times.set(at, all.map(() => [null, null, null]));
        times.get(at)[index] = [one.min, one.mean, one.max];
    }));
    const rows = [];
    let before = null;
    for (const at of [...times.keys()].sort((a, b) => a - b)) {
        if (before !== null && at - before > step * 1500) rows.push([new Date(before + step * 1000), ...all.map(() => [null, null, null])]);
        rows.push([new Date(at), ...times.get(at)]);
        before = at;
    }
    return rows;
}

/** Alarms and writes as lines from top to foot. */
function marks(canvas, area, graph, entries) {
    for (const entry of entries) {
        const x = graph.toDomXCoord(Date.parse(entry.time));
        if (x < area.x || x > area.x + area.w) continue;
        canvas.fillStyle = colour(entry.kind === 'write' ? 'muted' : 'bad');
        canvas.fillRect(x, area.y, 1, area.h);
    }
}

export function historyView({argument, detail}) {
    let span = 24 * HOUR;
    let isChosen = false;  // the span, by whoever looks
    let graph = null;
    let ended = false;
    let entries = [];
    const names = [];
    const units = new Map();  // of each name
    const bits = new Set();   // names of points that are on or off
    const chosen = new Set(argument && detail ? [`${argument}/${detail}`] : []);
    const box = h('div', {class: 'plot tall', role: 'img', 'aria-label': t('nav.history')});
    const said = h('p', {class: 'muted plot-values'});
    const picks = h('fieldset', {class: 'picks'}, h('legend', null, t('history.points', {count: MOST})));
    const none = h('p', {class: 'empty', hidden: true}, t('history.none'));
    const failed = h('p', {class: 'problem', hidden: true});
    const files = h('span');

    const say = (at, values) => said.replaceChildren(at === null ? '' : `${clockTime(at)} `, ...[...chosen].map((name, i) => h('span', {class: `tone ${COLOURS[i]}`},
        `${name} ${values[i] === null || values[i] === undefined ? '–' : `${number(values[i], 3)} ${units.get(name) ?? ''}`}`)));
    /** The points of the first point's unit have the left axis, all others the right one. */
    const axes = () => {
        const [first] = chosen;
        const others = [...chosen].filter((name) => units.get(name) !== units.get(first));
        const unitsOf = (all) => [...new Set(all.map((name) => units.get(name)).filter(Boolean))].join(', ');
        const axis = {axisLabelFormatter: (v) => number(v, 2), axisLabelWidth: 46};
        return {axes: {y: axis, y2: axis}, series: Object.fromEntries([...chosen].map((name) => [name, {...others.includes(name) ? {axis: 'y2'} : {}, stepPlot: bits.has(name)}])),
            ylabel: unitsOf([...chosen].filter((name) => !others.includes(name))), y2label: others.length > 0 ? unitsOf(others) : ''};
    };
    /** True once the first look has shown that less time than a day is kept, and a shorter span is read. */
    const narrow = (all) => {
        if (isChosen) return false;
        isChosen = true;
        const kept = Date.now() - Math.min(...all.flatMap(({samples}) => samples.slice(0, 1).map((one) => Date.parse(one.time))));
        const [fit] = SPANS.filter(([hours]) => Number(hours) * HOUR >= kept);
        if (!fit || Number(fit[0]) * HOUR >= span) return false;
        spans.value = fit[0];
        span = Number(fit[0]) * HOUR;
        read();
        return true;
    };
    const draw = async (all, step) => {
        const Dygraph = await library();
        const rows = rowsOf(all, step);
        const now = Date.now();
        const gap = all.map(() => [null, null, null]);
        if (rows.length > 0) rows.unshift([new Date(Math.min(now - span, rows[0][0])), ...gap]);
        if (rows.length > 1) rows.push([new Date(Math.max(now, rows.at(-1)[0].getTime() + 1)), ...gap]);
        if (ended) return;
        graph?.destroy();
        graph = null;
        none.hidden = rows.length > 0 || chosen.size === 0;
        say(null, rows.at(-2)?.slice(1).map((one) => one[1]) ?? []);
        if (rows.length < 2) return;
        graph = new Dygraph(box, rows, {labels: ['t', ...chosen], colors: COLOURS.map(colour), customBars: true, strokeWidth: 1.5, fillAlpha: 0.25,
            axisLineColor: colour('border'), gridLineColor: colour('border'), animatedZooms: false, showRangeSelector: true, rangeSelectorHeight: 30,
            ...axes(),
            underlayCallback: (canvas, area, drawn) => marks(canvas, area, drawn, entries),
            highlightCallback: (event, x, points) => say(x, points.map((point) => point.yval))});
        for (const handle of box.querySelectorAll('img')) handle.alt = '';
        box.dataset.rows = rows.length;
    };
    const read = async () => {
        const step = stepOf(span);
        const now = Date.now();
        const query = `?from=${new Date(now - span).toISOString()}&step=${step}s`;
        const target = (name) => path('stations', name.slice(0, name.indexOf('/')), 'points', name.slice(name.indexOf('/') + 1), 'history') + query;
        files.replaceChildren(...[...chosen].map((name) => h('span', null, ' ', download(target(name), `${name.replace('/', '-')}.csv`, `CSV ${name}`, {}, 'text/csv'))));
        try {
            const kinds = `?kind=write,alarm_raised,alarm_cleared&limit=500&since=${new Date(now - span).toISOString()}`;
            const [journal, ...all] = await Promise.all([get(path('journal') + kinds), ...[...chosen].map((name) => get(target(name)))]);
            entries = journal.entries.filter((entry) => [...chosen].some((name) => name === `${entry.station}/${entry.point}`));
            failed.hidden = true;
            if (narrow(all)) return;
            await draw(all, step);
        } catch (error) {
            failed.hidden = error.status === 0;
            text(failed, error.message);
        }
    };
    const pick = (name, input) => {
        if (input.checked) chosen.add(name);
        else chosen.delete(name);
        for (const other of picks.querySelectorAll('input')) other.disabled = chosen.size >= MOST && !other.checked;
        read();
    };
    const spans = choice(t('history.span'), SPANS, '24', (hours) => { isChosen = true; span = Number(hours) * HOUR; read(); });
    const learn = async () => {
        for (const station of live.stations) {
            const {points} = await get(path('stations', station.name, 'points'));
            for (const point of points) {
                if (point.type === 'string') continue;
                names.push(`${station.name}/${point.name}`);
                units.set(names.at(-1), word('unit', point.unit));
                if (point.type === 'bool') bits.add(names.at(-1));
            }
        }
        if (chosen.size === 0 && names.length > 0) chosen.add(names[0]);
        picks.append(...names.map((name) => {
            const input = h('input', {type: 'checkbox', checked: chosen.has(name), onchange: () => pick(name, input)});
            return h('label', {class: 'tick'}, input, ' ', name);
        }));
        read();
    };
    learn().catch(() => { /* the bar above the page says it */ });
    const timer = setInterval(() => document.hidden || span > 8 * HOUR || read(), 30000);
    return {node: h('div', null, h('h1', null, t('nav.history')), h('div', {class: 'bar'}, h('label', null, t('history.span'), ' ', spans), files), failed, box, said, none, picks),
        stop: () => { ended = true; clearInterval(timer); graph?.destroy(); }};
}
