// Elements without a framework. Nothing here parses HTML: texts stay texts.

const SVG = 'http://www.w3.org/2000/svg';

function assign(node, name, value) {
    if (value === null || value === undefined || value === false) return;
    if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (name === 'value' || name === 'checked' || name === 'selected') node[name] = value;
    else node.setAttribute(name, value === true ? '' : value);
}

function filled(node, attributes, children) {
    for (const [name, value] of Object.entries(attributes ?? {})) assign(node, name, value);
    node.append(...children.flat(Infinity).filter((c) => c !== null && c !== undefined && c !== false));
    return node;
}

/** An element; `onclick` and the like are listeners. Children: elements, texts, lists, null. */
export function h(tag, attributes, ...children) {
    return filled(document.createElement(tag), attributes, children);
}

export function svg(tag, attributes, ...children) {
    return filled(document.createElementNS(SVG, tag), attributes, children);
}

/** Changes the page only where it differs, so that nobody's selection or screen reader is disturbed. */
export function text(node, value) {
    if (node.textContent !== String(value)) node.textContent = value;
    return node;
}

export function attribute(node, name, value) {
    if (value === null || value === false) node.removeAttribute(name);
    else if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
    return node;
}

export function replace(node, ...children) {
    node.replaceChildren(...children.flat(Infinity).filter((c) => c !== null && c !== false));
    return node;
}

const kept = new WeakMap();  // container -> Map(key -> {node, update})

/** Shows a list: what `make(item)` gives ({node, update}) stays as long as its key does. */
export function list(container, items, key, make) {
    const before = kept.get(container) ?? new Map();
    const after = new Map();
    items.forEach((item, index) => {
        const name = key(item);
        const row = before.get(name) ?? make(item);
        row.update?.(item);
        after.set(name, row);
        if (container.children[index] !== row.node) {
            container.insertBefore(row.node, container.children[index] ?? null);
        }
    });
    while (container.children.length > items.length) container.lastElementChild.remove();
    kept.set(container, after);
    return container;
}

/** A select with [value, text] options. */
export function choice(label, options, value, changed) {
    const select = h('select', {'aria-label': label, onchange: () => changed(select.value)},
        options.map(([name, shown]) => h('option', {value: name, selected: name === value}, shown)));
    return select;
}

/** Makes a table's head and its body; rows are the caller's. The frame scrolls, not the page. Where that is narrow
 *  a row is a card, whose cells bear the names of their columns. */
export function table(caption, columns) {
    const body = h('tbody');
    const head = h('thead', null, h('tr', null, columns.map(([name, kind]) =>
        name === '' ? h('td') : h('th', {scope: 'col', class: kind}, name))));
    const label = () => {
        for (const row of body.rows) [...row.cells].forEach((cell, i) => attribute(cell, 'data-column', columns[i][0] || null));
    };
    new MutationObserver(label).observe(body, {childList: true});
    const node = h('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption},
        h('table', null, h('caption', {class: 'unseen'}, caption), head, body));
    return {node, body};
}
