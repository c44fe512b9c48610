/** Starting and ending the virtual scanner for tests.  Takes the machine's only port 3956 of 127.0.0.1. */
#ifndef WEFT_TESTS_RIG_PROCESS_H
#define WEFT_TESTS_RIG_PROCESS_H

#include <jansson.h>
#include <sys/types.h>

typedef struct rig_process {
    pid_t pid;
    char dir[512], pty[128], camera[128];
} rig_process;

/** Starts weft-rig in DIR with these options (ends with NULL) and waits until it is ready.  Skips the test
 *  when another program has the port. */
void rig_process_start(rig_process *rig, const char *dir, const char *const *options);

/** Tells it something; fails the test unless the reply says ok.  json_decref() it. */
json_t *rig_process_tell(const rig_process *rig, const char *line);

/** Sends the signal (0: tells it to quit) and waits.  @return the exit status, or 128 + signal */
int rig_process_end(rig_process *rig, int signal);

/** Runs weft-rig with these options to its end.  @return the exit status; `words` gets its stderr */
int rig_process_run(const char *const *options, char *words, size_t size);

#endif
