// HMR3300 compass at its pins, for simulation.
//
// As the maker says: ASCII lines at 8 a second, by itself after power-up, in the mode it was left in;
// *H and *M choose heading or magnetometer lines, *S stops and starts in turn, *Q asks for one
// line, each followed by CR LF; #I CR LF answers what it does not take. Of a sibling part: 800 ms from
// power to the first byte, and two lines of text before the first with numbers. Inferred: *H, *M and *Q
// are not taken while lines are sent; commands during the start are lost.
//
// All times are in cycles of clk. Lines of numbers have slots, LINE cycles apart, from the end of
// the start on, whether they are sent or not; slot k sends line k of the data, the last one for ever.
//
// +hmr3300_data=FILE    lines "heading pitch roll mx my mz": tenths of a degree, counts
// +hmr3300_faults=FILE  lines "from_slot to_slot bit": fault[bit] as well, in these slots
// +hmr3300_ppm=NUMBER   instead of PPM
module hmr3300_device #(
    parameter integer BIT = 5208,          // a bit
    parameter integer PPM = 0,             // how much longer a bit is, 1e-6
    parameter integer LINE = 12_500_000,   // from line to line
    parameter integer STARTUP = 80_000_000,
    parameter integer ANSWER = 100_000,    // from a command to what it does
    parameter integer GLITCH = 100,        // pulse of a glitch
    parameter integer WRONG_PPM = 150_000, // PPM while the rate is wrong
    parameter integer DATA_LINES = 16_384
) (
    input clk,
    input rst,
    input rx,
    output tx,
    // 0 silence, 1 garbage for lines, 2 stop bits missing, 3 glitches, 4 wrong rate, 5 lines cut
    // short, 6 a field missing, 7 numbers out of range, 8 stuck low, 9 stuck high, 10 commands
    // ignored, 11 reset when it begins
    input [11:0] fault,
    output reg [31:0] slot = 0             // of the last line that was due; 0 before, too
);
    // ---- data and faults
    reg signed [31:0] numbers [0:6*DATA_LINES-1];
    integer first [0:255], last [0:255], which [0:255];
    integer ppm = PPM, lines = 0, ranges = 0, file, got, k, n0, n1, n2, n3, n4, n5;
    reg [1023:0] name;
    initial begin
        for (k = 0; k < 6; k = k + 1) numbers[k] = 0;
        if ($value$plusargs("hmr3300_ppm=%d", k)) ppm = k;
        if ($value$plusargs("hmr3300_data=%s", name)) begin
            file = $fopen(name, "r");
            got = 6;
            // By variables: Icarus does not read into an element of an array.
            while (got == 6 && lines < DATA_LINES) begin
                got = $fscanf(file, "%d %d %d %d %d %d", n0, n1, n2, n3, n4, n5);
                numbers[6*lines] = n0;
                numbers[6*lines+1] = n1;
                numbers[6*lines+2] = n2;
                numbers[6*lines+3] = n3;
                numbers[6*lines+4] = n4;
                numbers[6*lines+5] = n5;
                if (got == 6) lines = lines + 1;
            end
            $fclose(file);
        end
        if ($value$plusargs("hmr3300_faults=%s", name)) begin
            file = $fopen(name, "r");
            got = 3;
            while (got == 3 && ranges < 256) begin
                got = $fscanf(file, "%d %d %d", n0, n1, n2);
                first[ranges] = n0;
                last[ranges] = n1;
                which[ranges] = n2;
                if (got == 3) ranges = ranges + 1;
            end
            $fclose(file);
        end
    end

    reg [11:0] active;
    integer n;
    always_comb begin
        active = fault;
        for (n = 0; n < ranges; n = n + 1)
            if (slot >= first[n] && slot <= last[n]) active = active | (12'd1 << which[n]);
    end

    // ---- characters to send
    reg [7:0] text [0:255];
    reg [7:0] head = 0, tail = 0;
    integer unsigned random = 32'h2545F491;

    reg [8*24-1:0] sentence;  // with bytes of 0 to its left

    task put;  // the sentence
        for (k = 23; k >= 0; k = k - 1)
            if (sentence[8*k +: 8] != 0) begin
                text[head] = sentence[8*k +: 8];
                head = head + 8'd1;
            end
    endtask

    reg counts = 0, streaming = 1;

    task put_line(input integer at);
        integer field, value, size, begins;
        begin
            begins = head;
            if (active[1]) begin
                for (field = 0; field < 20; field = field + 1) begin
                    random = random ^ (random << 13);
                    random = random ^ (random >> 17);
                    random = random ^ (random << 5);
                    text[head] = random[11:4];
                    head = head + 8'd1;
                end
            end else begin
                for (field = 0; field < 3; field = field + 1)
                    if (!(active[6] && field == 1)) begin
                        sentence = field == 0 ? "" : ", ";
                        put;
                        value = numbers[6 * at + field + (counts ? 3 : 0)];
                        if (active[7]) value = counts ? 40_000 : value + 3600;
                        size = value < 0 ? -value : value;
                        sentence = value < 0 ? "-" : "";
                        put;
                        if (counts) $sformat(sentence, "%0d", size);
                        else $sformat(sentence, "%0d.%0d", size / 10, size % 10);
                        put;
                    end
                sentence = "\015\n";
                if (!active[5]) put;
                else head = 8'(begins + 1 + (at % 12));
            end
        end
    endtask

    // ---- the device
    integer starting = STARTUP, due = 0, wait_answer = 0;
    reg [7:0] command = 0;   // that is to be done, 0 for none
    reg was_reset = 0, send = 0;
    reg [31:0] upcoming = 0; // slot
    integer at;

    // ---- sending: bits in units of a millionth of a cycle
    integer bits = 0;        // left of the byte
    reg [9:0] shift = 10'h3FF;
    reg level = 1, spoil = 0;
    reg signed [63:0] elapsed = 0;
    wire signed [63:0] length = 64'(BIT) * (64'sd1_000_000 + 64'(active[4] ? WRONG_PPM : ppm));
    integer glitch = 0, until_glitch = 0;
    assign tx = active[8] ? 1'b0 : active[9] ? 1'b1 : level ^ (glitch != 0);

    // ---- receiving
    reg [2:0] line = 3'b111;
    integer timer = 0, count = 0;
    reg [7:0] byte_in = 0;
    reg [31:0] last_four = 0;
    reg [7:0] seen = 0;      // characters of the line

    task understand(input [7:0] character);
        begin
            last_four = {last_four[23:0], character};
            seen = seen + 8'd1;
            if (character == 8'h0A) begin
                if (!active[10] && starting == 0) begin
                    command = seen == 4 && last_four[31:24] == "*" && last_four[15:8] == 8'h0D
                        ? last_four[23:16] : "?";
                    wait_answer = ANSWER;
                end
                seen = 0;
            end
        end
    endtask

    task obey;
        begin
            if (command == "S") streaming = !streaming;
            else if (command == "H" && !streaming) counts = 0;
            else if (command == "M" && !streaming) counts = 1;
            else if (command == "Q" && !streaming) put_line(at);
            else begin
                sentence = "#I\015\n";
                put;
            end
            command = 0;
        end
    endtask

    always @(posedge clk) begin
        at = lines == 0 ? 0 : slot < lines ? slot : lines - 1;
        random = random ^ (random << 13);
        random = random ^ (random >> 17);
        random = random ^ (random << 5);

        // Start, lines, commands.
        if (rst || (active[11] && !was_reset)) begin
            starting = STARTUP;
            streaming = 1;
            head = 0;
            tail = 0;
            command = 0;
            if (rst) begin
                counts = 0;
                slot <= 0;
                upcoming = 0;
                due = 0;
                send = 0;
            end
        end else if (starting != 0) begin
            starting = starting - 1;
            if (starting == 0) begin
                sentence = "HMR3300 1.0\015\n#OK\015\n";
                put;
            end
        end
        was_reset = active[11];
        if (send) begin
            send = 0;
            if (streaming && starting == 0 && !active[0]) put_line(at);
        end
        if (!rst && (starting == 0 || upcoming != 0)) begin
            due = due + 1;
            if (due == LINE) begin
                due = 0;
                slot <= upcoming;
                upcoming = upcoming + 1;
                send = 1;
            end
        end
        if (command != 0) begin
            if (wait_answer != 0) wait_answer = wait_answer - 1;
            else obey;
        end

        // Bits out.
        if (bits == 0) begin
            level <= 1;
            if (head != tail) begin
                spoil = active[2] && random[9:7] == 0;
                shift <= {!spoil, text[tail], 1'b0};
                tail = tail + 8'd1;
                bits = 10;
                elapsed = 0;
                level <= 0;
            end
        end else begin
            elapsed = elapsed + 64'sd1_000_000;
            if (elapsed >= length) begin
                elapsed = elapsed - length;
                bits = bits - 1;
                if (bits != 0) begin
                    shift <= {1'b1, shift[9:1]};
                    level <= shift[1];
                end else level <= 1;
            end
        end
        if (glitch != 0) glitch = glitch - 1;
        else if (active[3]) begin
            if (until_glitch != 0) until_glitch = until_glitch - 1;
            else begin
                glitch = GLITCH;
                until_glitch = BIT + (random[15:0] % (4 * BIT));
            end
        end

        // Bits in.
        line <= {line[1:0], rx};
        if (count == 0) begin
            if (!line[2]) begin
                count = 10;
                timer = BIT / 2;
            end
        end else if (timer != 0) timer = timer - 1;
        else begin
            timer = BIT - 1;
            count = count - 1;
            if (count == 9 && line[2]) count = 0;
            else if (count >= 1 && count <= 8) byte_in = {line[2], byte_in[7:1]};
            else if (count == 0 && line[2]) understand(byte_in);
        end
    end
endmodule
