/* firmware/linux/commands/picture.c - see picture.h. */
#include "firmware/linux/commands/picture.h"

#include "firmware/linux/base/error.h"
#include "firmware/linux/base/output.h"

static int picture_open(struct output *output, const char *path,
                        enum plot_format *format)
{
    const int found = plot_format_of(path);
    *format = (enum plot_format)found;
    return found < 0 ? -1 : output_open(output, path);
}

static int picture_close(struct output *output, int drawn,
                         struct messages *messages)
{
    error_tell(messages);
    if (drawn == 0 || output->error != 0) /* which it says */
        return output_commit(output);
    output_abandon(output);
    return -1;
}

int picture_of_job(const struct job *job, const struct trace *trace,
                   const char *path)
{
    struct messages messages = { .text = NULL };
    struct output output;
    enum plot_format format;
    if (picture_open(&output, path, &format) < 0)
        return -1;
    return picture_close(&output,
                         plot_write(job, trace, format, output.file, &messages),
                         &messages);
}

int picture_of_space(const struct job *job, const struct plot_film *carried,
                     const char *path)
{
    struct messages messages = { .text = NULL };
    struct output output;
    enum plot_format format;
    if (picture_open(&output, path, &format) < 0)
        return -1;
    return picture_close(
        &output, plot_space_write(job, carried, format, output.file, &messages),
        &messages);
}

int picture_of_otg(const struct otg_motion *motion, const char *title,
                   const char *subtitle, const char *path)
{
    struct messages messages = { .text = NULL };
    struct output output;
    enum plot_format format;
    if (picture_open(&output, path, &format) < 0)
        return -1;
    return picture_close(
        &output,
        plot_otg_write(motion, title, subtitle, format, output.file, &messages),
        &messages);
}
