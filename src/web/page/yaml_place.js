// Where in a YAML text somebody types, and what the schema has there.

/** The schema behind a $ref. */
function resolved(schema, root) {
    let found = schema;
    while (found?.$ref) found = found.$ref.replace('#/', '').split('/').reduce((at, part) => at?.[part], root);
    return found ?? {};
}

/** All that a value may be: itself, or one of several. */
function kinds(schema, root) {
    const found = resolved(schema, root);
    return [found, ...[...(found.oneOf ?? []), ...(found.anyOf ?? []), ...(found.allOf ?? [])].flatMap((one) => kinds(one, root))];
}

/** The properties of the map that `keys` lead to, lists between. */
export function propertiesAt(schema, keys) {
    let at = [schema];
    const inside = (all) => all.flatMap((one) => kinds(one, schema)).flatMap((one) => one.items ? kinds(one.items, schema) : [one]);
    for (const key of keys) {
        at = inside(at).flatMap((one) => one.properties?.[key] ? [one.properties[key]] : one.additionalProperties?.constructor === Object ? [one.additionalProperties] : []);
    }
    return Object.assign({}, ...inside(at).map((one) => one.properties ?? {}));
}

/** The values that a property may have by their names. */
export function valuesOf(schema, property) {
    return kinds(property, schema).flatMap((one) => one.enum ?? ('const' in one ? [one.const] : one.type === 'boolean' ? [true, false] : [])).map(String);
}

const KEY = /^(\s*(?:-\s+)*)([\w-]+)\s*:/;

/** The keys within { } that end at the end of this text: [keys of outer maps, text of the last]. */
function flow(text) {
    const open = [];
    let key = null;
    for (const part of text.match(/[{}[\],]|[\w-]+\s*:|[^{}[\],]/g) ?? []) {
        if (part === '{' || part === '[') {
            open.push(key);
            key = null;
        } else if (part === '}' || part === ']') {
            open.pop();
            key = null;
        } else if (part === ',') {
            key = null;
        } else if (part.endsWith(':') && part.length > 1) {
            key = part.slice(0, -1).trim();
        }
    }
    return open;
}

/** What is typed at a place: {keys: of the maps around, key: whose value it is or null, word, from: its column}. */
export function placeAt(lines, row, column) {
    const text = lines[row].slice(0, column);
    const [word] = /[\w.-]*$/.exec(text);
    const from = column - word.length;
    const before = text.slice(0, from);
    const [, key = null] = /([\w-]+)\s*:\s*$/.exec(before) ?? [];
    const inner = flow(before);
    let depth = inner.length > 0 ? (KEY.exec(text)?.[1].length ?? text.search(/\S/)) : KEY.exec(text)?.[1].length ?? (/^\s*(?:-\s+)*/.exec(before)[0].length);
    const keys = inner.filter((one) => one !== null);
    if (inner.length > 0 && keys.length === 0 && !KEY.test(text)) depth = text.search(/\S|$/) + 1;
    for (let at = row - 1; at >= 0 && depth > 0; at--) {
        const [, indent, name] = KEY.exec(lines[at]) ?? [];
        if (name === undefined || indent.length >= depth || lines[at].trimStart().startsWith('#')) continue;
        if (/:\s*(#.*)?$/.test(lines[at])) keys.unshift(name);
        depth = indent.length;
    }
    return {keys, key, word, from};
}
