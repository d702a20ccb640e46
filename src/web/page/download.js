// Answers that are taken away as files.
import {getFile, hasToken} from './api.js';
import {dialog, refusal} from './confirm.js';
import {h} from './dom.js';
import {t} from './language.js';

async function save(target, name, accept) {
    try {
        const address = URL.createObjectURL(await getFile(target, accept));
        h('a', {href: address, download: name}).click();
        URL.revokeObjectURL(address);
    } catch (error) {
        const node = dialog(name, refusal(error), h('div', {class: 'bar end'}, h('button', {type: 'button', onclick: () => node.close()}, t('close'))));
    }
}

/**
 * A link to a file; the page fetches a file for a client with a token, and one of another form than the
 * usual (`accept`), for a link carries no headers.
 */
export function download(target, name, said, looks = {}, accept = null) {
    return h('a', {...looks, href: target, download: name, onclick: (event) => {
        if (!hasToken() && !accept) return;
        event.preventDefault();
        save(target, name, accept);
    }}, said);
}
