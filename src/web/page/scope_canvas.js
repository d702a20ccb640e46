// Draws a line's time: a row for each station, its frames as blocks, what lies between them beside
// them. Knows nothing of the page but its canvas.

const HEAD = 22;     // px: the ruler
const ROW = 30;      // px
const BLOCK = 16;    // px
const LABEL = 92;    // px: names at the left
const NEAR = 4;      // px: how far beside a frame still means it

/** Steps of the ruler, in seconds. */
const STEPS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60];

export const colours = 8;

/** The page's colours, by name, as they are now: the theme may change. */
function palette(node) {
    const style = getComputedStyle(node);
    const named = {};
    for (const name of ['text', 'muted', 'border', 'surface', 'bad', 'warn', 'accent', 'silence', 'rest']) {
        named[name] = style.getPropertyValue(`--${name}`).trim();
    }
    named.station = Array.from({length: colours}, (_, i) => style.getPropertyValue(`--c${i}`).trim());
    named.font = `12px ${style.fontFamily}`;
    return named;
}

export class ScopeCanvas {
    #hits = [];

    constructor(canvas) { this.canvas = canvas; }

    /** `rows`: [{station, name, colour}], the top one first. Instants in seconds. */
    draw({timeline, from, to, rows, selected}) {
        const {canvas} = this;
        const height = HEAD + ROW * (rows.length + 1);
        const width = canvas.clientWidth;
        const scale = window.devicePixelRatio || 1;
        if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
            canvas.width = Math.round(width * scale);
            canvas.height = Math.round(height * scale);
            canvas.style.height = `${height}px`;
        }
        const pen = canvas.getContext('2d');
        pen.setTransform(scale, 0, 0, scale, 0, 0);
        pen.clearRect(0, 0, width, height);
        this.view = {pen, timeline, from, to, rows, width, height, colours: palette(canvas), selected};
        pen.font = this.view.colours.font;
        pen.textBaseline = 'middle';
        this.#ruler();
        this.#between();
        const seen = this.#frames();
        this.#decisions();
        this.#names();
        return seen;
    }

    /** The frame at a point of the canvas, or null. */
    at(x, y) {
        const near = this.#hits.filter((hit) => x >= hit.left - NEAR && x <= hit.right + NEAR && y >= hit.top && y <= hit.bottom);
        near.sort((a, b) => Math.abs(x - (a.left + a.right) / 2) - Math.abs(x - (b.left + b.right) / 2));
        return near[0]?.frame ?? null;
    }

    /** The instant at this x. */
    instant(x) {
        const {from, to, width} = this.view;
        return from + (x - LABEL) / (width - LABEL) * (to - from);
    }
    /** Seconds of a pixel. */
    get grain() { return (this.view.to - this.view.from) / (this.view.width - LABEL); }

    #x(at) {
        const {from, to, width} = this.view;
        return LABEL + (at - from) / (to - from) * (width - LABEL);
    }
    #row(station) {
        const {rows} = this.view;
        const index = rows.findIndex((row) => row.station === station);
        return HEAD + ROW * (index < 0 ? rows.length - 1 : index);
    }

    #ruler() {
        const {pen, timeline, from, to, width, height, colours: c} = this.view;
        const step = STEPS.find((one) => one / (to - from) * (width - LABEL) > 90) ?? 60;
        const shift = timeline.wall(from) - from;
        for (let wall = Math.ceil((from + shift) / step) * step; wall < to + shift; wall += step) {
            const x = this.#x(wall - shift);
            pen.fillStyle = c.border;
            pen.fillRect(x, HEAD - 4, 1, height);
            pen.fillStyle = c.muted;
            pen.fillText(tick(wall, step), x + 4, HEAD / 2);
        }
    }

    #between() {
        const {pen, timeline, from, to, colours: c} = this.view;
        for (const span of timeline.between(from, to)) {
            const left = Math.max(LABEL, this.#x(span.from));
            const right = this.#x(span.to);
            if (right <= left) continue;
            const middle = this.#row(span.station) + ROW / 2;
            if (span.kind === 'think') bar(pen, c.muted, left, middle - 1, right, 2);
            else if (span.kind === 'gap') bar(pen, c.accent, left, middle + BLOCK / 2 + 2, right, 2);
            else if (span.kind === 'silence') stripes(pen, c.silence, left, middle - BLOCK / 2, right, BLOCK);
            else bar(pen, c.rest, left, middle - BLOCK / 2 - 3, right, 3);
        }
    }

    #frames() {
        const {pen, timeline, from, to, rows, selected, colours: c} = this.view;
        const seen = timeline.seen(from, to);
        this.#hits = [];
        for (const frame of seen) {
            const left = Math.max(LABEL, this.#x(frame.from));
            const right = Math.max(left + 1.5, this.#x(frame.to));
            const top = this.#row(frame.station) + (ROW - BLOCK) / 2;
            const row = rows.find((one) => one.station === frame.station) ?? rows.at(-1);
            block(pen, frame, c.station[row.colour], c, left, top, right);
            if (frame.sequence === selected) {
                pen.strokeStyle = c.text;
                pen.lineWidth = 2;
                pen.strokeRect(left - 2, top - 2, right - left + 4, BLOCK + 4);
            }
            this.#hits.push({frame, left, right, top, bottom: top + BLOCK});
        }
        return seen;
    }

    #decisions() {
        const {pen, timeline, from, to, height, colours: c} = this.view;
        pen.fillStyle = c.warn;
        for (const told of timeline.decisions) {
            if (told.at < from || told.at > to) continue;
            const x = this.#x(told.at);
            const y = height - ROW / 2;
            pen.beginPath();
            pen.moveTo(x, y - 6);
            pen.lineTo(x + 5, y + 4);
            pen.lineTo(x - 5, y + 4);
            pen.fill();
            this.#hits.push({frame: told, left: x - 5, right: x + 5, top: y - 8, bottom: y + 6});
        }
    }

    #names() {
        const {pen, rows, height, colours: c} = this.view;
        pen.fillStyle = c.surface;
        pen.fillRect(0, 0, LABEL, height);
        rows.forEach((row, index) => {
            const middle = HEAD + ROW * index + ROW / 2;
            pen.fillStyle = c.station[row.colour];
            pen.fillRect(0, middle - 7, 4, 14);
            pen.fillStyle = c.text;
            pen.fillText(row.name, 10, middle, LABEL - 14);
        });
        pen.fillStyle = c.muted;
        pen.fillText(this.decisionsName ?? '', 10, height - ROW / 2, LABEL - 14);
    }
}

function tick(wall, step) {
    const time = new Date(wall * 1000);
    const two = (value) => String(value).padStart(2, '0');
    if (step >= 1) return `${two(time.getHours())}:${two(time.getMinutes())}:${two(time.getSeconds())}`;
    const digits = step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3;
    return `:${(Math.round((wall % 60) * 1000) / 1000).toFixed(digits).padStart(3 + digits, '0')}`;
}

function bar(pen, colour, left, top, right, height) {
    pen.fillStyle = colour;
    pen.fillRect(left, top, right - left, height);
}

function stripes(pen, colour, left, top, right, height) {
    pen.save();
    pen.beginPath();
    pen.rect(left, top, right - left, height);
    pen.clip();
    pen.strokeStyle = colour;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (let x = left - height; x < right; x += 6) {
        pen.moveTo(x, top + height);
        pen.lineTo(x + height, top);
    }
    pen.stroke();
    pen.restore();
}

/** Sent: an outline; received: full; thrown away: crossed out. */
function block(pen, frame, colour, c, left, top, right) {
    const width = right - left;
    if (frame.direction === 'discarded') {
        pen.fillStyle = c.bad;
        pen.fillRect(left, top + 3, width, BLOCK - 6);
        return;
    }
    const refused = frame.direction === 'received' && (frame.data[1] & 0x80) !== 0;
    pen.fillStyle = refused ? c.warn : colour;
    if (frame.direction === 'received' || width < 4) {
        pen.fillRect(left, top, width, BLOCK);
        return;
    }
    pen.globalAlpha = 0.25;
    pen.fillRect(left, top, width, BLOCK);
    pen.globalAlpha = 1;
    pen.strokeStyle = frame.note === 'request' || frame.note === 'heard request' ? colour : c.warn;
    pen.lineWidth = 1.5;
    pen.strokeRect(left + 0.75, top + 0.75, width - 1.5, BLOCK - 1.5);
}
