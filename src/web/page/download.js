// Answers that are taken away as files.
import {getFile, hasToken} from './api.js';
import {dialog, refusal} from './confirm.js';
import {h} from './dom.js';
import {t} from './language.js';

async function save(target, name) {
    try {
        const address = URL.createObjectURL(await getFile(target));
        h('a', {href: address, download: name}).click();
        URL.revokeObjectURL(address);
    } catch (error) {
        const node = dialog(name, refusal(error), h('div', {class: 'bar end'}, h('button', {type: 'button', onclick: () => node.close()}, t('close'))));
    }
}

/** A link to a file; with a token the page fetches it, for a link carries none. */
export function download(target, name, said, looks = {}) {
    return h('a', {...looks, href: target, download: name, onclick: (event) => {
        if (!hasToken()) return;
        event.preventDefault();
        save(target, name);
    }}, said);
}
