// A modal dialog whose buttons end it.
import { elementOf } from '../dom';

export interface Dialog { element: HTMLDialogElement; form: HTMLFormElement; body: HTMLElement; foot: HTMLElement }

/** Makes a dialog with a title; show() adds it to the page. */
export function makeDialog(title: string): Dialog {
  const body = elementOf('div', { class: 'body' }), foot = elementOf('div', { class: 'foot' });
  const form = elementOf('form', { method: 'dialog' }, elementOf('h2', { id: 'dialog-title' }, title), body, foot);
  return { element: elementOf('dialog', { 'aria-labelledby': 'dialog-title' }, form), form, body, foot };
}

/** Ends the dialog that is shown, if any, as Escape does. */
export function closeDialog(): void {
  for (const dialog of document.querySelectorAll('dialog')) dialog.close();
}

/** Shows a dialog until a button or Escape ends it. The answer is the value of the button, or empty. */
export async function show({ element }: Dialog): Promise<string> {
  closeDialog(); // never two
  document.body.append(element);
  element.addEventListener('click', (e) => { if (e.target === element) element.close(''); }); // beside it
  element.showModal();
  await new Promise((resolve) => element.addEventListener('close', resolve, { once: true }));
  element.remove();
  return element.returnValue;
}

export const cancelButton = (text = 'Cancel'): HTMLElement => elementOf('button', { type: 'submit', value: '', formnovalidate: true }, text);
