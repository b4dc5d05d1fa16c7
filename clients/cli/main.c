/* lightprobe, the command line: sets up the process and hands over. */
#include "clients/cli/command.h"

#include <signal.h>

int main(int argc, char **argv)
{
    /* A reader that leaves early (`lightprobe stats | head`) is a failed write, not a death. */
    signal(SIGPIPE, SIG_IGN);
    return command_dispatch(argc, argv);
}
