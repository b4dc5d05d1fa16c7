/* lightprobe, the command line: sets up the process and hands over. */
#include "clients/cli/command.h"

#include <signal.h>
#include <stdio.h>

int main(int argc, char **argv)
{
    /* A reader that leaves early (`lightprobe stats | head`) is a failed write, not a death. */
    signal(SIGPIPE, SIG_IGN);
    int status = command_dispatch(argc, argv);
    /* What was printed must have arrived: a full disk is a failure, whatever else went well. */
    if ((ferror(stdout) || fflush(stdout) != 0) && status == COMMAND_DONE) {
        fputs("lightprobe: standard output: cannot be written; is the disk full, or the reader "
              "gone?\n",
              stderr);
        return COMMAND_FAILED;
    }
    return status;
}
