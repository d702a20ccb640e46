// Follows the traces of lines, as long as somebody looks.
import {gateway, get, path, seesWhole} from './api.js';
import {t} from './language.js';
import {Timeline, characterTime} from './timeline.js';

const PERIOD = 400;  // ms
const PAGE = 500;    // entries the gateway gives at once

const WANDERS = 30000;  // ms that the clocks may differ more than they did, before that counts

let ahead = null;  // ms that the gateway's clock is ahead of ours, at least

/** What the gateway's clock on the wall says, in ms since 1970: frames that were just told are hardly older. */
export const gatewayNow = () => Date.now() + (ahead ?? 0);

function hear(frame) {
    const least = Date.parse(frame.time) - Date.now();
    if (ahead === null || least > ahead || least < ahead - WANDERS) ahead = least;
}

class Trace extends EventTarget {
    #line;
    #next = null;
    #timer = null;
    #watchers = 0;
    refusal = '';  // why the gateway does not tell us

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

    /** Who may not read every station of a line gets nothing of its trace, until a view asks anew. */
    #refuse(why) {
        this.refusal = why;
        this.dispatchEvent(new Event('change'));
    }

    async #ask() {
        if (!seesWhole(this.#line)) return queueMicrotask(() => this.#refuse(t('not.whole')));
        let full = false;
        try {
            const asked = this.#next === null ? 'last=500' : `since=${this.#next}`;
            const page = await get(path('lines', this.#line, 'trace') + '?' + asked);
            const count = page.frames.length + page.decisions.length + (page.transactions?.length ?? 0);
            full = this.#next !== null && count >= PAGE;
            if (this.#next !== null && !full && page.frames.length > 0) hear(page.frames.at(-1));
            if (page.next < (this.#next ?? 0)) this.timeline = new Timeline(this.timeline.character);
            this.#next = page.next;
            if (count > 0) {
                this.timeline.add(page);
                this.dispatchEvent(new Event('change'));
            }
            this.refusal = '';
        } catch (error) {  // without an answer the bar above the page says why
            if (error.status === 403) {
                this.#refuse(error.message);
                return;
            }
        }
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
