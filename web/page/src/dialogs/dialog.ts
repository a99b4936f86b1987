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
  // A click beside it ends it, but not the end of a drag that selects a text in it.
  let beside = false;
  element.addEventListener('pointerdown', (e) => { beside = e.target === element; });
  element.addEventListener('click', (e) => { if (beside && e.target === element) closeDialog(); });
  element.showModal();
  await new Promise((resolve) => element.addEventListener('close', resolve, { once: true }));
  element.remove();
  return element.returnValue;
}

/** Ends the dialog as Escape does. It does not submit the form, as Enter in a field presses the first button that does. */
export function cancelButton(text = 'Cancel'): HTMLElement {
  const button = elementOf('button', { type: 'button' }, text);
  button.addEventListener('click', closeDialog);
  return button;
}
