"""Files that come in are read in a process of their own, with a limit of memory and a deadline.

`host` is a small process that has the readers loaded and forks one child an import; `child` reads and sends the samples
through a socket (`frames`); `client` is what the service calls. The service itself opens no file that it was sent.
"""
