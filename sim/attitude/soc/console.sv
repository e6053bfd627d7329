// The console of a soft core. Arguments: keys (bytes to it in hexadecimal, the lowest first) and
// keys_at (cycle of the first). It prints
//   T byte         a byte from the console
module console #(
    parameter DIVISOR = 8,
    parameter KEY_BITS = 12  // from key to key
) (
    input clk,
    input rst,
    input [31:0] now,
    input tx,
    output reg rx
);
    reg [63:0] keys;
    integer keys_at, key_ticks, key_bit, ticks, count;
    reg [9:0] bits;
    reg busy;
    initial begin
        if (!$value$plusargs("keys=%h", keys)) keys = 0;
        if (!$value$plusargs("keys_at=%d", keys_at)) keys_at = 0;
        rx = 1; key_ticks = 0; key_bit = 0;
        busy = 0; ticks = 0; count = 0;
    end
    always @(posedge clk) begin
        if (now >= keys_at && keys != 0) begin
            if (key_ticks == 0) begin
                key_ticks <= DIVISOR - 1;
                rx <= key_bit == 0 ? 1'b0 : key_bit <= 8 ? keys[key_bit - 1] : 1'b1;
                key_bit <= key_bit == KEY_BITS - 1 ? 0 : key_bit + 1;
                if (key_bit == KEY_BITS - 1) keys <= keys >> 8;
            end else key_ticks <= key_ticks - 1;
        end
        // Bits from the console in the middle of their time.
        if (!busy) begin
            if (!tx && !rst) begin
                busy <= 1;
                ticks <= DIVISOR / 2;
                count <= 0;
            end
        end else if (ticks == 0) begin
            bits <= {tx, bits[9:1]};
            ticks <= DIVISOR - 1;
            count <= count + 1;
            if (count == 9) begin
                busy <= 0;
                $display("T %0d", bits[9:2]);
            end
        end else ticks <= ticks - 1;
    end
endmodule
