// The difference of two texts, line by line.
const MOST = 4_000_000;  // pairs of lines that are compared; beyond, all between is another

/** The longest common lines of two short lists: pairs of indices. */
function common(before, after) {
    const width = after.length + 1;
    const longest = new Uint32Array((before.length + 1) * width);
    for (let i = before.length - 1; i >= 0; i--) {
        for (let j = after.length - 1; j >= 0; j--) {
            longest[i * width + j] = before[i] === after[j] ? longest[(i + 1) * width + j + 1] + 1
                : Math.max(longest[(i + 1) * width + j], longest[i * width + j + 1]);
        }
    }
    const pairs = [];
    for (let i = 0, j = 0; i < before.length && j < after.length;) {
        if (before[i] === after[j]) pairs.push([i++, j++]);
        else if (longest[(i + 1) * width + j] >= longest[i * width + j + 1]) i++;
        else j++;
    }
    return pairs;
}

/** [{kind: 'same' | 'gone' | 'come', line}] */
export function difference(before, after) {
    const old = before.split('\n');
    const now = after.split('\n');
    let head = 0;
    while (head < old.length && head < now.length && old[head] === now[head]) head++;
    let tail = 0;
    while (tail < old.length - head && tail < now.length - head && old.at(-1 - tail) === now.at(-1 - tail)) tail++;
    const [a, b] = [old.slice(head, old.length - tail), now.slice(head, now.length - tail)];
    const found = old.slice(0, head).map((line) => ({kind: 'same', line}));
    let [i, j] = [0, 0];
    for (const [x, y] of [...(a.length * b.length > MOST ? [] : common(a, b)), [a.length, b.length]]) {
        while (i < x) found.push({kind: 'gone', line: a[i++]});
        while (j < y) found.push({kind: 'come', line: b[j++]});
        if (x < a.length) found.push({kind: 'same', line: a[i]});
        i++;
        j++;
    }
    return [...found, ...old.slice(old.length - tail).map((line) => ({kind: 'same', line}))];
}

/** Only what differs, with so many lines around; null stands for what is left out. */
export function excerpt(lines, around = 3) {
    const near = lines.map((_, at) => lines.slice(Math.max(0, at - around), at + around + 1).some((one) => one.kind !== 'same'));
    return lines.flatMap((one, at) => near[at] ? [one] : near[at - 1] || at === 0 ? [null] : []);
}
