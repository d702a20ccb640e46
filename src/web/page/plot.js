// Plots: dygraphs (MIT), which the gateway serves beside this page; and lines too small for axes.
import {h, svg} from './dom.js';
import {clockTime, number, t} from './language.js';

let loading = null;

/** Its legend writes a style into HTML, which the page's policy forbids; ours stands beside the plot. */
function withoutLegend(Dygraph) {
    Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
    return Dygraph;
}

/** The library, fetched when the first plot is looked at. */
export function library() {
    loading ??= new Promise((resolve, reject) => {
        document.head.append(h('link', {rel: 'stylesheet', href: 'page/dygraph.min.css'}),
            h('script', {src: 'page/dygraph.min.js', onload: () => resolve(withoutLegend(window.Dygraph)), onerror: reject}));
    });
    return loading;
}

/** On an axis; between two seconds ":05.500". */
function axisTime(date) {
    const two = (value, length = 2) => String(value).padStart(length, '0');
    return date.getMilliseconds() === 0 ? clockTime(date) : `:${two(date.getSeconds())}.${two(date.getMilliseconds(), 3)}`;
}

const TICK = 12;  // pixels of a failure at the foot of a plot

/** Each row as a bar of its own: what nobody measured is not painted. The whole comes first, its parts before it. */
function bars({points, drawingContext: canvas, color, plotArea: area}) {
    canvas.fillStyle = color;
    for (const {canvasx, canvasy, yval} of points) {
        if (!Number.isNaN(yval) && yval !== null) canvas.fillRect(canvasx - 1, canvasy, 2, area.y + area.h - canvasy);
    }
}

/** Failures as ticks: pale from top to foot, and full where the axis is. */
function ticks(canvas, area, graph, failed) {
    canvas.fillStyle = colour('bad');
    for (const at of failed) {
        const x = graph.toDomXCoord(at);
        if (x < area.x || x > area.x + area.w) continue;
        canvas.globalAlpha = 0.2;
        canvas.fillRect(x - 1, area.y, 2, area.h);
        canvas.globalAlpha = 1;
        canvas.fillRect(x - 1, area.y + area.h - TICK, 2, TICK);
    }
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/**
 * A plot over time, up to now(). read(): {rows: [[ms since 1970, value, ...]], failed: [ms]}, the oldest
 * first; null is a gap, and each failure a tick. labels: of the values; colours: names of the page's;
 * stacked: bars, with the values one on top of the other; steps: a value holds until the next. Gives
 * {node, update, stop}; beside the picture stands its last row in words.
 */
export function plot({title, unit, labels, colours, stacked = false, steps = false, read, now}) {
    const box = h('div', {class: 'plot', role: 'img', 'aria-label': title});
    const said = h('p', {class: 'muted plot-values', 'aria-live': 'off'});
    const node = h('figure', null, h('figcaption', null, title, unit ? ` (${unit})` : ''), box, said);
    let graph = null;
    let ended = false;
    let failed = [];
    let shown = [];
    const say = (values) => {
        said.replaceChildren(...labels.map((label, i) => h('span', {class: `tone ${colours[i]}`},
            `${label} ${values[i] === null || values[i] === undefined || Number.isNaN(values[i]) ? '–' : number(values[i], 2)}`)),
        failed.length > 0 ? h('span', {class: 'tone bad'}, t('plot.failed', {count: failed.length})) : '');
    };
    const options = () => ({
        labels: ['t', ...labels], colors: colours.map(colour), stackedGraph: stacked, stepPlot: steps,
        axisLineColor: colour('border'), gridLineColor: colour('border'), strokeWidth: 1.5, fillAlpha: 0.5,
        axes: {x: {axisLabelFormatter: axisTime, pixelsPerLabel: 130, axisLabelWidth: 130}, y: {axisLabelFormatter: (v) => number(v, 2), axisLabelWidth: 46}},
        includeZero: stacked, animatedZooms: false, stackedGraphNaNFill: 'none', ...stacked ? {plotter: bars} : {},
        underlayCallback: (canvas, area, drawn) => ticks(canvas, area, drawn, failed),
        highlightCallback: (event, x, points) => say(points.map((point) => point.yval)),
        unhighlightCallback: () => last(),
    });
    const last = () => say((shown.at(-1) ?? []).slice(1));
    const update = async () => {
        const Dygraph = await library();
        const {rows, failed: those = []} = read();
        if (ended || rows.length < 2 || !node.isConnected) return;
        failed = those;
        shown = rows;
        const end = Math.max(now(), rows.at(-1)[0] + 1);
        const data = [...rows, [end, ...labels.map(() => null)]].map(([at, ...values]) => [new Date(at), ...values]);
        graph ??= new Dygraph(box, data, options());
        graph.updateOptions({file: data, colors: colours.map(colour)});
        Object.assign(box.dataset, {failed: failed.length, to: Math.round(end)});
        last();
    };
    return {node, update, stop: () => { ended = true; graph?.destroy(); }};
}

const WIDTH = 120;
const HEIGHT = 28;

/** A line without axes; what it says stands beside it in words. */
export function sparkline() {
    const line = (name) => svg('path', {class: name, fill: 'none', 'stroke-width': 1.5, 'stroke-linecap': 'round', 'vector-effect': 'non-scaling-stroke'});
    const shape = line('value');
    const missing = line('missing');
    const node = svg('svg', {class: 'spark', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: 'none', 'aria-hidden': 'true'}, missing, shape);
    /** null is a gap; `ticked`: and a failure. */
    const update = (values, {least = 0, most = -Infinity, ticked = false} = {}) => {
        const known = values.filter((value) => value !== null);
        const low = Math.min(least, ...known);
        const high = Math.max(low + 1e-9, most, ...known);
        const x = (i) => values.length < 2 ? 0 : i / (values.length - 1) * WIDTH;
        const y = (value) => HEIGHT - 2 - (value - low) / (high - low) * (HEIGHT - 4);
        const to = (value, i) => `${(values[i - 1] ?? null) === null ? 'M' : 'L'}${x(i).toFixed(1)},${y(value).toFixed(1)}${(values[i + 1] ?? null) === null ? 'h0.1' : ''}`;
        shape.setAttribute('d', values.map((value, i) => value === null ? '' : to(value, i)).join(''));
        missing.setAttribute('d', ticked ? values.map((value, i) => value === null ? `M${x(i).toFixed(1)},${HEIGHT - 8}V${HEIGHT}` : '').join('') : '');
    };
    return {node, update};
}
