// Server-sent events as text (HTML standard, 9.2.6). Pure.

/** Cuts a stream into its events, wherever its parts begin and end. */
export class EventText {
    #rest = '';

    /** The events that this part completes: [{type, data}], the oldest first. */
    add(part) {
        const blocks = (this.#rest + part).split('\n\n');
        this.#rest = blocks.pop();
        return blocks.map(event).filter(({data}) => data !== '');
    }
}

/** Of lines "name: value"; a line that begins with a colon is a comment. */
function event(block) {
    const lines = block.split('\n').map((line) => /^(\w+): ?(.*)$/.exec(line)).filter(Boolean);
    const values = (name) => lines.filter(([, field]) => field === name).map(([, , value]) => value);
    return {type: values('event').at(-1) ?? 'message', data: values('data').join('\n')};
}
