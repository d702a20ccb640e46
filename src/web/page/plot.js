// Plots: dygraphs (MIT), which the gateway serves beside this page; and lines too small for axes.
import {h, svg} from './dom.js';
import {clockTime, number} from './language.js';

let loading = null;

/** Its legend writes a style into HTML, which the page's policy forbids; ours stands beside the plot. */
function withoutLegend(Dygraph) {
    Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
    return Dygraph;
}

/** The library, fetched when the first plot is looked at. */
function library() {
    loading ??= new Promise((resolve, reject) => {
        document.head.append(h('link', {rel: 'stylesheet', href: 'page/dygraph.min.css'}),
            h('script', {src: 'page/dygraph.min.js', onload: () => resolve(withoutLegend(window.Dygraph)), onerror: reject}));
    });
    return loading;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/**
 * A plot over time. rows(): [[Date, value, ...]], the oldest first; labels: of the values; colours:
 * names of the page's; steps: a value holds until the next. Gives {node, update, stop}; beside the picture stands its last row in words.
 */
export function plot({title, unit, labels, colours, stacked = false, steps = false, rows}) {
    const box = h('div', {class: 'plot', role: 'img', 'aria-label': title});
    const said = h('p', {class: 'muted plot-values', 'aria-live': 'off'});
    const node = h('figure', null, h('figcaption', null, title, unit ? ` (${unit})` : ''), box, said);
    let graph = null;
    let ended = false;
    const say = (values) => {
        said.replaceChildren(...labels.map((label, i) => h('span', {class: `tone ${colours[i]}`},
            `${label} ${values[i] === null || values[i] === undefined ? '–' : number(values[i], 2)}`)));
    };
    const options = () => ({
        labels: ['t', ...labels], colors: colours.map(colour), stackedGraph: stacked, stepPlot: steps,
        axisLineColor: colour('border'), gridLineColor: colour('border'), strokeWidth: 1.5, fillAlpha: 0.5,
        axes: {x: {axisLabelFormatter: clockTime, pixelsPerLabel: 90}, y: {axisLabelFormatter: (v) => number(v, 2), axisLabelWidth: 46}},
        includeZero: stacked, animatedZooms: false,
        highlightCallback: (event, x, points) => say(points.map((point) => point.yval)),
        unhighlightCallback: () => last(),
    });
    const last = () => say((rows().at(-1) ?? []).slice(1));
    const update = async () => {
        const Dygraph = await library();
        const data = rows();
        if (ended || data.length < 2 || !node.isConnected) return;
        graph ??= new Dygraph(box, data, options());
        graph.updateOptions({file: data, colors: colours.map(colour)});
        last();
    };
    return {node, update, stop: () => { ended = true; graph?.destroy(); }};
}

const WIDTH = 120;
const HEIGHT = 28;

/** A line without axes; what it says stands beside it in words. */
export function sparkline() {
    const shape = svg('polyline', {fill: 'none', 'stroke-width': 1.5, 'vector-effect': 'non-scaling-stroke'});
    const node = svg('svg', {class: 'spark', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: 'none', 'aria-hidden': 'true'}, shape);
    const update = (values, least = 0, most = -Infinity) => {
        const low = Math.min(least, ...values);
        const high = Math.max(low + 1e-9, most, ...values);
        const x = (i) => values.length < 2 ? 0 : i / (values.length - 1) * WIDTH;
        const y = (value) => HEIGHT - 2 - (value - low) / (high - low) * (HEIGHT - 4);
        shape.setAttribute('points', values.map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(1)}`).join(' '));
    };
    return {node, update};
}
