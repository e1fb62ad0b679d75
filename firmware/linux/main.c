/* firmware/linux/main.c - the program slew. */
#include <signal.h>

#include "firmware/linux/commands/command.h"

int main(int argc, char *argv[])
{
    signal(SIGPIPE, SIG_IGN); /* write errors are seen where they happen */
    return (int)command_main(argc, argv);
}
