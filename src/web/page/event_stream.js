// Server-sent events, with our token: an EventSource cannot send one.
import {asUs} from './api.js';

/** Tells each event as a MessageEvent of its type, until it is closed or the gateway ends it. */
export class EventStream extends EventTarget {
    closed = false;
    #given = new AbortController();

    /** `last`: the id of an event that is known already. */
    constructor(path, last) {
        super();
        this.last = last;
        this.#read(path).catch(() => { /* it is closed */ }).finally(() => { this.closed = true; });
    }

    close() {
        this.closed = true;
        this.#given.abort();
    }

    async #read(path) {
        const headers = this.last ? {'Last-Event-ID': this.last} : {};
        const response = await fetch(path, {...asUs('GET', headers), signal: this.#given.signal});
        if (!response.ok) return;
        const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
        let rest = '';
        for (;;) {
            const {done, value} = await reader.read();
            if (done) return;
            const parts = (rest + value).split('\n\n');
            rest = parts.pop();
            for (const part of parts) this.#tell(part);
        }
    }

    #tell(part) {
        let type = 'message';
        const data = [];
        for (const line of part.split('\n')) {
            const colon = line.indexOf(':');
            const name = line.slice(0, colon);
            const value = line.slice(colon + 1).replace(/^ /, '');
            if (name === 'event') type = value;
            else if (name === 'data') data.push(value);
            else if (name === 'id') this.last = value;
        }
        if (data.length && !this.closed) this.dispatchEvent(new MessageEvent(type, {data: data.join('\n')}));
    }
}
