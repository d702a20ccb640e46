// Follows the traces of lines, as long as somebody looks.
import {gateway, get, path} from './api.js';
import {Timeline, characterTime} from './timeline.js';

const PERIOD = 400;  // ms
const PAGE = 500;    // entries the gateway gives at once

class Trace extends EventTarget {
    #line;
    #next = null;
    #timer = null;
    #watchers = 0;

    constructor(line) {
        super();
        this.#line = line;
        const configured = gateway.configuration?.lines.find((one) => one.name === line);
        this.timeline = new Timeline(characterTime(configured?.serial));
    }

    /** Starts with the first that looks; the function it gives ends it with the last. */
    watch(changed) {
        this.addEventListener('change', changed);
        if (this.#watchers++ === 0) this.#ask();
        return () => {
            this.removeEventListener('change', changed);
            if (--this.#watchers === 0) clearTimeout(this.#timer);
        };
    }

    async #ask() {
        let full = false;
        try {
            const asked = this.#next === null ? 'last=500' : `since=${this.#next}`;
            const page = await get(path('lines', this.#line, 'trace') + '?' + asked);
            const count = page.frames.length + page.decisions.length + (page.transactions?.length ?? 0);
            full = this.#next !== null && count >= PAGE;
            if (page.next < (this.#next ?? 0)) this.timeline = new Timeline(this.timeline.character);
            this.#next = page.next;
            if (count > 0) {
                this.timeline.add(page);
                this.dispatchEvent(new Event('change'));
            }
        } catch { /* the bar above the page says it */ }
        if (this.#watchers === 0) return;
        clearTimeout(this.#timer);
        const pause = document.hidden ? 10 * PERIOD : full ? 0 : PERIOD;
        this.#timer = setTimeout(() => this.#ask(), pause);
    }
}

const traces = new Map();

export function traceOf(line) {
    if (!traces.has(line)) traces.set(line, new Trace(line));
    return traces.get(line);
}
