/* firmware/linux/service/listen.h - the socket of a service: one at a path.
 *
 * One that was left by a process that was killed is replaced, one that is served
 * is not.  Of several that look, make or take away in a folder at one time each
 * waits for the others, so that none takes a fresh one for one that was left. */
#ifndef FIRMWARE_LINUX_SERVICE_LISTEN_H
#define FIRMWARE_LINUX_SERVICE_LISTEN_H

#define SERVICE_KNOCKS 64 /* that wait to be let in */

/* A Unix socket that listens at `path`, for `mode` (0600: its owner).  -1: not, with
 * a line on stderr. */
int service_listen(const char *path, unsigned mode);
void service_listen_end(int listener, const char *path);

#endif
