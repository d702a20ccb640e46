// From a line's trace to what was on its wire when. Pure: time is in seconds of the gateway's clock.

/** Seconds of one character at "38400 8N1": start bit, data, parity, stop bits. */
export function characterTime(serial) {
    const [, baud, data, parity, stop] = /^(\d+) (\d)([A-Z])(\d)/.exec(serial ?? '') ?? [0, 19200, 8, 'E', 1];
    return (1 + Number(data) + (parity === 'N' ? 0 : 1) + Number(stop)) / Number(baud);
}

export const bytesOf = (hex) => hex === '' ? [] : hex.split(' ').map((pair) => parseInt(pair, 16));

const LONGEST_GAP = 0.02;    // seconds: beyond, the line had nothing to do
const LONGEST_WAIT = 1;      // seconds: nobody is drawn as waited for longer
const OF_STATION = 600;      // exchanges that are remembered of each
const LATELY = 200;          // exchanges that the figures are of
const RESTS = /^only this request is sent for ([\d.]+) ms: station (\d+)/;

/** A frame of the trace with its begin and end: `at` is its first bit out, or its last byte in. */
function segment(frame, character) {
    const bytes = bytesOf(frame.bytes);
    const length = bytes.length * character;
    const sent = frame.direction === 'sent';
    return {
        ...frame, data: bytes,
        from: sent ? frame.at : frame.at - length,
        to: sent ? frame.at + length : frame.at,
        wall: Date.parse(frame.time) / 1000,
    };
}

/** The one open request, and what came of it. */
function open(request) {
    return {request, reply: null, station: request.station, broadcast: request.station === 0};
}

/** What the panel took to think, and what was on the wire, in milliseconds. */
function measured(exchange) {
    const {request, reply} = exchange;
    const out = request.to - request.from;
    const back = reply ? reply.to - reply.from : 0;
    exchange.wire = (out + back) * 1000;
    exchange.think = reply ? Math.max(0, reply.from - request.to) * 1000 : null;
    exchange.total = reply ? (exchange.queue ?? 0) + (reply.to - request.from) * 1000 : null;
    exchange.failed = reply ? (reply.data[1] & 0x80) !== 0 : !exchange.broadcast;
    return exchange;
}

export class Timeline {
    segments = [];   // frames, the oldest first
    exchanges = [];  // a request and its reply
    decisions = [];
    character;
    #stations = new Map();  // id -> its last exchanges
    #most;
    #open = null;

    /** `most`: frames that are remembered. */
    constructor(character, most = 5000) {
        this.character = character;
        this.#most = most;
    }

    /** Adds a page of the trace: {frames, decisions, transactions}, the oldest first, each once. */
    add(page) {
        for (const frame of page.frames) this.#take(segment(frame, this.character));
        for (const told of page.decisions) this.decisions.push(decision(told));
        for (const told of page.transactions ?? []) this.#measure(told);
        this.segments.splice(0, Math.max(0, this.segments.length - this.#most));
        this.exchanges.splice(0, Math.max(0, this.exchanges.length - this.#most));
        this.decisions.splice(0, Math.max(0, this.decisions.length - this.#most));
    }

    #take(frame) {
        const before = this.segments.at(-1);
        if (before && frame.direction !== 'sent') frame.from = Math.max(frame.from, Math.min(before.to, frame.to));
        this.segments.push(frame);
        if (frame.direction === 'sent' || frame.note === 'heard request') {
            this.#open = open(frame);
            this.exchanges.push(measured(this.#open));
            const its = this.of(frame.station);
            its.push(this.#open);
            if (its.length > OF_STATION) its.shift();
            this.#stations.set(frame.station, its);
        } else if (frame.direction === 'received' && this.#open?.station === frame.station) {
            frame.answers = this.#open.request;
            this.#open.reply = frame;
            measured(this.#open);
            this.#open = null;
        }
    }

    /** A transaction that is over has instants that are better than ours. */
    #measure(told) {
        const exchange = this.exchanges.findLast((one) => one.request.sequence === told.sequence);
        if (!exchange) return;
        Object.assign(exchange, {client: told.client, outcome: told.outcome});
        if (told.arrived !== null) exchange.queue = Math.max(0, told.first_bit_out - told.arrived) * 1000;
        exchange.request.to = told.last_bit_out;
        if (exchange.reply && told.first_byte_in !== null) {
            exchange.reply.from = Math.max(told.first_byte_in, told.last_bit_out);
        }
        measured(exchange);
    }

    /** What nobody knows the end of yet: the last request, while it waits for its reply. */
    get waiting() { return this.#open?.outcome === undefined ? this.#open : null; }

    /** The last exchanges with a station, the oldest first. */
    of(station) { return this.#stations.get(station) ?? []; }

    /** What happened last. */
    get end() { return Math.max(this.segments.at(-1)?.to ?? 0, this.decisions.at(-1)?.at ?? 0); }
    get begin() { return this.segments[0]?.from ?? 0; }
    /** Wall time of an instant. */
    wall(at) {
        const known = this.segments.at(-1);
        return known ? known.wall + (at - known.at) : at;
    }

    /** Frames that are seen between two instants. */
    seen(from, to) {
        let low = 0;
        let high = this.segments.length;
        while (low < high) {
            const middle = (low + high) >> 1;
            if (this.segments[middle].to < from) low = middle + 1;
            else high = middle;
        }
        const found = [];
        for (let i = low; i < this.segments.length && this.segments[i].from <= to; ++i) found.push(this.segments[i]);
        return found;
    }

    /** Between the frames: {kind: 'think' | 'gap' | 'silence' | 'rest', from, to, station}. */
    between(from, to) {
        const found = [];
        for (let i = this.exchanges.length - 1; i >= 0; --i) {
            const {request, reply, broadcast} = this.exchanges[i];
            if (request.from < from - LONGEST_WAIT) break;
            const next = this.exchanges[i + 1]?.request.from ?? this.end;
            const station = request.station;
            if (reply) found.push({kind: 'think', from: request.to, to: reply.from, station});
            else if (!broadcast) {
                found.push({kind: 'silence', from: request.to, to: Math.min(next, request.to + LONGEST_WAIT), station});
            }
            const idle = reply?.to ?? (broadcast ? request.to : null);
            if (idle !== null && next - idle < LONGEST_GAP) found.push({kind: 'gap', from: idle, to: next, station});
        }
        for (const told of this.decisions) {
            if (told.rest && told.at < to && told.at + told.rest > from) {
                found.push({kind: 'rest', from: told.at, to: told.at + told.rest, station: told.station});
            }
        }
        return found;
    }
}

function decision(told) {
    const rest = RESTS.exec(told.text);
    return {...told, wall: Date.parse(told.time) / 1000, rest: rest ? Number(rest[1]) / 1000 : 0,
        station: rest ? Number(rest[2]) : null};
}

/**
 * Exchanges as a plot shows them, without `waiting` and broadcasts: rows [ms since 1970, queue, wire,
 * think], null where nothing was measured, and in `failed` when those were asked that failed.
 */
export function plotted(exchanges, waiting) {
    const rows = [];
    const failed = [];
    for (const one of exchanges) {
        if (one === waiting || one.broadcast) continue;
        const at = one.request.wall * 1000;
        rows.push(one.total === null ? [at, null, null, null] : [at, one.queue ?? 0, one.wire, one.think]);
        if (one.failed) failed.push(at);
    }
    return {rows, failed};
}

/** Of the latest exchanges of a station: how many, and mean and 95 % of each part, in
 * milliseconds; null where nothing is known. */
export function latency(exchanges) {
    const lately = exchanges.slice(-LATELY);
    const good = lately.filter((exchange) => exchange.reply);
    const figures = (part) => {
        const values = good.map((exchange) => exchange[part]).filter((value) => value !== undefined).sort((a, b) => a - b);
        const sum = values.reduce((a, b) => a + b, 0);
        return {mean: values.length ? sum / values.length : null, high: values[Math.floor(values.length * 0.95)] ?? null};
    };
    return {count: lately.length, answered: good.length, queue: figures('queue'), wire: figures('wire'),
        think: figures('think'), total: figures('total')};
}
