/* firmware/linux/main.c - the program slew. */
#include "firmware/linux/commands/command.h"

int main(int argc, char *argv[])
{
    return (int)command_main(argc, argv);
}
