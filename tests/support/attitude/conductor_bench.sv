// Plays a script (script.txt) to the attitude core and prints what it does; see conductor_bench.py.
module bench #(parameter WORD = 32, FILTER_BITS = 2) (input clk, input rst);
    reg sample, line, is_counts, run, restart, load, take1, w_stb, feed_en, feed_take;
    reg [4:0] feed_index;
    wire feed_busy;
    reg [31:0] stamp, cycle;
    reg [15:0] words [0:7];
    reg [47:0] values;
    reg [FILTER_BITS-1:0] filter;
    reg [1:0] source;
    reg [5:0] index0, index1;
    reg [9:0] addr;
    reg [WORD-1:0] w_data;
    wire [2:0] index;
    wire updated, w_ack;
    wire [15:0] number;
    wire [5:0] events;
    wire [WORD-1:0] value0, value1, r_data;

    attitude_core dut (
        .clk(clk), .rst(rst), .sample(sample), .stamp(stamp), .index(index),
        .word({words[index], 2'b00}), .line(line), .is_counts(is_counts), .values(values),
        .filter(filter), .source(source), .run(run), .restart(restart), .load_states(load),
        .updated(updated),
        .number(number), .events(events), .ports__0__take(updated), .ports__0__index(index0),
        .ports__0__value(value0), .ports__1__take(take1), .ports__1__index(index1),
        .ports__1__value(value1), .bus__addr(addr), .bus__w_data(w_data), .bus__w_stb(w_stb),
        .bus__w_ack(w_ack), .bus__r_data(r_data)
`ifdef FEED
        , .feed_en(feed_en), .feed_index(feed_index), .feed_data(w_data), .feed_take(feed_take),
        .feed_busy(feed_busy)
`endif
        );
`ifndef FEED
    assign feed_busy = 0;
`endif

    integer file, scanned, k, left, updates, wanted, dump0, dump1, reading;
    reg [7:0] command;
    reg [31:0] a, b, c, d, e, f, g;

    initial begin
        file = $fopen("script.txt", "r");
        {sample, line, is_counts, run, restart, load, take1, w_stb, feed_en, feed_take, feed_index} = 0;
        {stamp, cycle, values, filter, source, index0, index1, addr, w_data} = 0;
        {left, updates, wanted, dump0, dump1, reading} = 0;
        for (k = 0; k < 8; k = k + 1) words[k] = 0;
    end

    always @(posedge clk) begin
        cycle <= cycle + 1;
        if (!rst) begin
            {sample, line, restart, load, take1, feed_take} <= 0;
            if (sample) $display("S %0d", cycle);
            if (events[5:1] != 0) $display("E %0d %0d", cycle, events);
            // The newest update is read by the first port at once, index by index.
            if (updated) begin
                updates <= updates + 1;
                $display("U %0d", cycle);
                index0 <= 0;
                dump0 <= 1;
            end else if (dump0 != 0) begin
                index0 <= index0 + 1;
                dump0 <= dump0 == 65 ? 0 : dump0 + 1;
                if (dump0 > 1) $display("D %0d %0h", dump0 - 2, value0);
            end
            if (dump1 != 0) begin
                index1 <= index1 + 1;
                dump1 <= dump1 == 65 ? 0 : dump1 + 1;
                if (dump1 > 1) $display("Q %0d %0h", dump1 - 2, value1);
            end
            if (reading != 0) begin
                reading <= reading - 1;
                if (reading == 1) $display("R %0d %0h", addr, r_data);
            end
            if (w_stb && w_ack) w_stb <= 0;
            if (!feed_busy) feed_en <= 0;
            if (left != 0) left <= left - 1;
            else if ((!w_stb || w_ack) && !(feed_en && feed_busy) && updates >= wanted && reading == 0) begin
                scanned = $fscanf(file, "%c", command);
                if (scanned != 1) $finish;
                case (command)
                    "w": begin scanned = $fscanf(file, "%d\n", a); left <= a; end
                    "s": begin
                        scanned = $fscanf(file, "%h %h %h %h %h %h %h\n", a, b, c, d, e, f, g);
                        sample <= 1;
                        stamp <= a;
                        words[0] <= b; words[1] <= c; words[2] <= d;
                        words[3] <= e; words[4] <= f; words[5] <= g;
                    end
                    "l": begin
                        scanned = $fscanf(file, "%d %h %h %h\n", a, b, c, d);
                        line <= 1;
                        is_counts <= a[0];
                        values <= {d[15:0], c[15:0], b[15:0]};
                    end
                    "f": begin scanned = $fscanf(file, "%d\n", a); filter <= a; end
                    "o": begin scanned = $fscanf(file, "%d\n", a); source <= a; end
                    "u": begin scanned = $fscanf(file, "%d\n", a); run <= a; end
                    "r": begin scanned = $fscanf(file, "\n"); restart <= 1; end
                    "i": begin scanned = $fscanf(file, "\n"); load <= 1; end
                    "b": begin
                        scanned = $fscanf(file, "%d %h\n", a, b);
                        addr <= a; w_data <= b; w_stb <= 1;
                    end
                    "d": begin
                        scanned = $fscanf(file, "%d\n", a);
                        addr <= a; reading <= 2;
                    end
                    "e": begin
                        scanned = $fscanf(file, "%d %h\n", a, b);
                        feed_index <= a; w_data <= b; feed_en <= 1;
                    end
                    "k": begin scanned = $fscanf(file, "\n"); feed_take <= 1; end
                    "n": begin scanned = $fscanf(file, "%d\n", a); wanted <= a; end
                    "t": begin scanned = $fscanf(file, "\n"); take1 <= 1; end
                    "q": begin scanned = $fscanf(file, "\n"); index1 <= 0; dump1 <= 1; left <= 70; end
                    default: begin $display("bad command"); $finish; end
                endcase
            end
        end
    end
endmodule
