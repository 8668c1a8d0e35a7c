"""The app: a window in the browser with a form, live answers, runs and their reports; `femgear app` opens it."""
